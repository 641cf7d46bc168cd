from .calibration import calibrate as calibrate
from .compare import compare as compare
from .control import FrameSolver as FrameSolver
from .errors import IknsError as IknsError
from .files import read as read
from .files import write_c3d as write_c3d
from .interpolation import NaturalNeighborInterpolator as NaturalNeighborInterpolator
from .marker_ik import MarkerIK as MarkerIK
from .marker_set import MarkerSet as MarkerSet
from .motion import Motion as Motion
from .nullspace_map import NullSpaceMap as NullSpaceMap
from .nullspace_map import analytic_map as analytic_map
from .nullspace_map import null_space_samples as null_space_samples
from .recording import Recording as Recording
from .scaling import scale as scale
from .simulation import simulate_protocol as simulate_protocol
from .simulation import virtual_subject as virtual_subject
from .simulation import write_protocol as write_protocol
from .skeleton import Robot as Robot
from .skeleton import Skeleton as Skeleton
from .subject import Subject as Subject
from .warm_up import warm_up as warm_up

__version__: str
