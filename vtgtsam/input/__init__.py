# SPDX-License-Identifier: MIT
"""What comes from outside: how much of it is taken, how it is read, and how its text is shown."""
