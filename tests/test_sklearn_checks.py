"""Scikit-learn's own conformance checks, none exempted and none skipped."""

import warnings

import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from ikns.nullspace.clustering import BoundingBoxKMeans
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import IntentMap


@pytest.fixture(autouse=True)
def array_api(monkeypatch):
    """One check is left out unless this is set; here it sees plain NumPy arrays."""
    monkeypatch.setenv("SCIPY_ARRAY_API", "1")


# The map keeps the conventions without scikit-learn's base class, whose import takes
# longer than most commands.
with warnings.catch_warnings():
    warnings.filterwarnings("ignore", ".*does not inherit", UserWarning)
    all_checks = parametrize_with_checks(
        [
            BoundingBoxKMeans(),
            NullSpaceMap(),
            NullSpaceMap(interpolation="smooth"),
            NaturalPosture(),
            IntentMap(n_points=2),
        ]
    )


# The checks fit a few dozen random samples, about which a map rightly warns.
@pytest.mark.filterwarnings("ignore::ikns.nullspace.map.MapWarning")
@pytest.mark.filterwarnings("ignore:.*does not inherit:UserWarning")
@all_checks
def test_estimators_keep_the_conventions_of_scikit_learn(estimator, check):
    check(estimator)
