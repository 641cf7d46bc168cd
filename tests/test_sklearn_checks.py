"""Scikit-learn's own conformance checks, none exempted and none skipped."""

import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from ikns.nullspace.clustering import BoundingBoxKMeans
from ikns.nullspace.map import NullSpaceMap


@pytest.fixture(autouse=True)
def array_api(monkeypatch):
    """One check is left out unless this is set; here it sees plain NumPy arrays."""
    monkeypatch.setenv("SCIPY_ARRAY_API", "1")


# The checks fit a few dozen random samples, about which a map rightly warns.
@pytest.mark.filterwarnings("ignore::ikns.nullspace.map.MapWarning")
@parametrize_with_checks([BoundingBoxKMeans(), NullSpaceMap()])
def test_estimators_keep_the_conventions_of_scikit_learn(estimator, check):
    check(estimator)
