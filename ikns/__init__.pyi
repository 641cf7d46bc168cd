from .errors import IknsError as IknsError
from .marker_ik import MarkerIK as MarkerIK
from .marker_set import MarkerSet as MarkerSet
from .motion import Motion as Motion
from .recording import Recording as Recording
from .scaling import scale as scale
from .skeleton import Skeleton as Skeleton

__version__: str
