# SPDX-License-Identifier: MIT
"""The subcommands of ``vtgtsam``, one a file: they read arguments, call the library and print.

What is slow to import is imported inside the functions, so that ``vtgtsam --help`` answers at once.
"""
