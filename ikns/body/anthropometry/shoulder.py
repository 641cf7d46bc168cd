"""Joint positions of the shoulder girdle in the thorax."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.anthropometry.measures import checked_measure, expected_measure
from ikns.body.anthropometry.tables import row


def shoulder_joints(
    stature: ArrayLike, sex: str, *, biacromial: ArrayLike | None = None
) -> dict[str, Array]:
    """Joints and acromion of the right shoulder girdle of a person who stands upright.

    No table gives the glenohumeral center's distance from the midline, so it is half
    the biacromial breadth minus an offset between two published shoulder models; the
    heights come from de Leva's trunk, the rest from a published model of a man
    (``shoulder.toml`` states each source and its reliability). Offsets scale with
    stature. The acromion is assumed to be straight above the joint.

    Parameters
    ----------
    stature : float or (N,) array
        Meters.
    sex : str
        "female" or "male".
    biacromial : float or (N,) array, optional
        Breadth between the lateral points of the acromia, meters; without it the mean
        of people of this stature.

    Returns
    -------
    dict of (3,) or (N, 3) arrays
        ``sternoclavicular``, ``glenohumeral``, ``acromion``: meters from suprasternale
        in the thorax axes of Wu et al. 2005 (J Biomech 38(5):981-992), X forward,
        Y up, Z right. For the left side mirror Z.

    Raises
    ------
    InvalidInput
        When the sex is unknown, or stature or breadth is not an adult's in meters.

    Examples
    --------
    >>> shoulder_joints(1.75, "male")["glenohumeral"].round(3).tolist()
    [-0.018, -0.016, 0.181]
    """
    height = checked_measure("stature", stature)
    if biacromial is None:
        breadth = expected_measure("biacromial_breadth", height, sex)
    else:
        breadth = checked_measure("biacromial breadth", biacromial)

    def offset(name: str) -> Array:
        return np.asarray(row("shoulder", name, sex=sex)["offset"])

    lateral = breadth / 2 - offset("acromion_to_glenohumeral") * height
    up = offset("glenohumeral_up") * height
    forward = offset("glenohumeral_forward") * height
    above = offset("acromion_above_glenohumeral") * height
    return {
        "sternoclavicular": height[..., np.newaxis] * offset("sternoclavicular"),
        "glenohumeral": np.stack([forward, up, lateral], axis=-1),
        "acromion": np.stack([forward, up + above, breadth / 2], axis=-1),
    }


def clavicle_length(
    stature: ArrayLike, sex: str, *, biacromial: ArrayLike | None = None
) -> Array:
    """Distance from the sternoclavicular to the glenohumeral joint center, meters.

    Parameters and errors as in :func:`shoulder_joints`; () or (N,) array.
    """
    joints = shoulder_joints(stature, sex, biacromial=biacromial)
    reach = joints["glenohumeral"] - joints["sternoclavicular"]
    return np.asarray(np.linalg.norm(reach, axis=-1))
