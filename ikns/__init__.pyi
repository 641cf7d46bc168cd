# Public names, in the order of the docstring of __init__.py.
# Recording
from .recording.files import read as read
from .recording.files import write as write
from .recording.files import write_c3d as write_c3d
from .recording.recording import Recording as Recording

# Skeleton
from .body.skeleton import Skeleton as Skeleton
from .body.marker_set import MarkerSet as MarkerSet
from .calibration.scaling import scale as scale
from .symbolic import fit_lengths as fit_lengths
from .body.chain import Chain as Chain
from .body.chain_files import load_chain as load_chain
from .body.chain_files import extrinsic_chain as extrinsic_chain
from .body.skeleton import Robot as Robot

# Motion
from .motion.marker_ik import MarkerIK as MarkerIK
from .motion.motion import Motion as Motion

# Map
from .calibration.judge.recordings import check_recordings as check_recordings
from .calibration import calibrate as calibrate
from .calibration.rewear import rewear as rewear
from .calibration.method_summary import method_summary as method_summary
from .calibration.subject import Subject as Subject
from .nullspace.map import NullSpaceMap as NullSpaceMap
from .nullspace.map import null_space_samples as null_space_samples
from .nullspace.map import analytic_map as analytic_map
from .nullspace.interpolation import (
    NaturalNeighborInterpolator as NaturalNeighborInterpolator,
)
from .nullspace.readout import IntentMap as IntentMap
from .nullspace.natural_posture import NaturalPosture as NaturalPosture
from .nullspace.hinge_swivel import hinge_swivel as hinge_swivel

# Control
from .live.stream import open_source as open_source
from .live.control import FrameSolver as FrameSolver
from .live.runtime import run as run
from .live.session import read_run as read_run
from .live.runtime import replay_run as replay_run
from .live.warm_up import warm_up as warm_up

# Finger
from .finger import open_finger as open_finger
from .finger import open_fingers as open_fingers
from .finger import SimulatedFinger as SimulatedFinger
from .finger import DynamixelFinger as DynamixelFinger
from .finger import check_finger as check_finger

# Analysis
from .analysis.compare import compare as compare
from .analysis.compare import compare_motion as compare_motion
from .analysis.compare import compare_samples as compare_samples
from .analysis.ucm import variance_split as variance_split
from .analysis.ucm import across_trials as across_trials
from .analysis.ucm import within_trial as within_trial
from .analysis.ucm import surrogate_test as surrogate_test
from .symbolic import available_range as available_range
from .symbolic import available_control as available_control

# Simulation
from .simulation import virtual_subject as virtual_subject
from .simulation import simulate_protocol as simulate_protocol
from .simulation import write_protocol as write_protocol

# Errors
from .errors import IknsError as IknsError

__version__: str
