"""MuJoCo worlds: physics, sensors and cameras of simulated robots.

Rendering contexts are made explicitly by `gl_camera`, so MuJoCo must not pick an OpenGL back end on import:
on a machine without that back end the import itself would fail.
"""

import os

os.environ["MUJOCO_GL"] = "disable"
