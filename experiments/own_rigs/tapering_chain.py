"""A chain of 20 tapering links with three tendons, in MuJoCo, as a rig: it bends in no arc of constant curvature."""

from wristctl.mujoco_rig import MujocoRig
from wristctl.plugins.import_hook import data_file

RIG = MujocoRig(data_file(__file__, "tapering_chain.xml"), bend="tip")
