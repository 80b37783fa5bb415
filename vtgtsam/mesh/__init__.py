# SPDX-License-Identifier: MIT
"""Triangle meshes: read, refused where nothing can be made of them, turned outwards, looked over."""
