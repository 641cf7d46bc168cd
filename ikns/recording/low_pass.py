"""A low-pass filter for noisy positions, such as keypoints from video."""

from __future__ import annotations

import math

import numpy as np

from ikns.errors import InvalidInput
from ikns.recording.recording import Recording

#: Order of the Butterworth filter, run forwards and backwards, so that it is doubled
#: and nothing is late: what biomechanics calls a fourth-order zero-lag filter
#: (Winter, Biomechanics and Motor Control of Human Movement, section 3.4.4).
_ORDER = 2
#: Two passes leave half the power at the cut-off only if each is wider by this much.
_TWO_PASSES = (math.sqrt(2) - 1) ** (1 / (2 * _ORDER))


def low_pass(recording: Recording, cutoff: float) -> Recording:
    """Return the recording with positions filtered, gaps as they were.

    A zero-lag Butterworth low-pass of order four that halves the power at `cutoff`.
    Each stretch in which a marker is seen is filtered by itself.

    Parameters
    ----------
    recording : Recording
        Of a steady rate.
    cutoff : float
        Hz; voluntary arm movement lies below 6 Hz or so.

    Raises
    ------
    InvalidInput
        When the cut-off is not between 0 and half the frame rate.

    Examples
    --------
    >>> time = np.arange(200) / 100
    >>> noise = np.random.default_rng(0).normal(0, 0.01, (200, 1, 3))
    >>> noisy = Recording(time, noise, ["RWrist"])
    >>> bool(low_pass(noisy, 5.0).markers.std() < noise.std() / 2)
    True
    """
    from scipy.signal import butter, sosfiltfilt

    time = recording.time
    rate = recording.rate if len(time) > 1 else math.nan
    if not 0 < cutoff < rate / 2 * _TWO_PASSES:
        raise InvalidInput(
            f"{recording.source}: --cutoff must be above 0 and below "
            f"{rate / 2 * _TWO_PASSES:.3g} Hz at {rate:g} frames per second, found "
            f"{cutoff:g} Hz."
        )
    sos = butter(_ORDER, cutoff / _TWO_PASSES, fs=rate, output="sos")
    # The ends are continued by their reflection, over two periods of the cut-off.
    longest = math.ceil(2 * rate / cutoff)
    markers = np.array(recording.markers)
    seen = np.asarray(np.isfinite(markers).all(axis=2))
    for m in range(markers.shape[1]):
        ends = np.flatnonzero(np.diff(np.r_[False, seen[:, m], False]))
        for first, after in ends.reshape(-1, 2):
            part = markers[first:after, m]
            markers[first:after, m] = sosfiltfilt(
                sos, part, axis=0, padlen=min(longest, len(part) - 1)
            )
    return Recording(time, markers, recording.labels, recording.source)
