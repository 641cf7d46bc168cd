"""Every held place gets a cluster of its own, and nothing else changes."""

import warnings

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from ikns.calibration.places import recorded_places
from ikns.errors import InvalidInput
from ikns.nullspace.clustering import BoundingBoxKMeans, box_surface_points
from ikns.nullspace.clustering.lloyd import two_places
from ikns.nullspace.map import MapWarning, NullSpaceMap

BOX = np.array([*np.ndindex(2, 2, 2), (0.5, 1, 0.5), (0.5, 0, 0.5)], float)
BOX = BOX * [0.18, 0.34, 0.35]


def held(rng, places, *, n=60, spread=0.006):
    """Samples around places, with a few on the way, and which place each is of."""
    which = np.repeat(np.arange(len(places)), n)
    x = places[which] + rng.normal(scale=spread, size=(len(which), 3))
    share = rng.uniform(size=(3 * (len(places) - 1), 1))
    first = np.repeat(np.arange(len(places) - 1), 3)
    way = places[first] + share * (places[first + 1] - places[first])
    return np.vstack([x, way]), np.r_[which, np.full(len(way), -1)]


def free_places(rng):
    places = [rng.uniform(0, 0.5, 3)]
    while len(places) < 10:
        one = rng.uniform(0, 0.5, 3)
        if cdist([one], places).min() > 0.1:
            places.append(one)
    return np.array(places)


LAYOUTS = {
    "box, 4 cm off": lambda rng: BOX + rng.normal(scale=0.04, size=BOX.shape),
    "box, 6 cm off": lambda rng: BOX + rng.normal(scale=0.06, size=BOX.shape),
    "anywhere, 10 cm apart": free_places,
    "some of ten": lambda rng: BOX[rng.permutation(10)[: rng.integers(4, 9)]],
}


def own_lloyd(x, centers):
    """The paper's iteration, written for this test alone."""
    centers, labels = centers.copy(), None
    while True:
        nearest = ((x[:, None] - centers) ** 2).sum(axis=2).argmin(axis=1)
        if labels is not None and (nearest == labels).all():
            return centers, labels
        labels = nearest
        for k in set(labels):
            centers[k] = x[labels == k].mean(axis=0)


def homes(labels, which):
    return [
        np.bincount(labels[which == k] + 1).argmax() - 1 for k in range(which.max() + 1)
    ]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_place_keeps_a_cluster_and_kept_ones_keep_their_digits(layout):
    lost = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        places = LAYOUTS[layout](rng)
        x, which = held(rng, places)
        found = BoundingBoxKMeans(len(places)).fit(x)
        here = homes(found.labels_, which)
        assert len(set(here)) == len(places)
        assert -1 not in here
        assert found.merged_ == []
        centers, labels = own_lloyd(x, box_surface_points(found.box_, len(places)))
        if len(set(homes(labels, which))) == len(places):
            assert np.array_equal(found.cluster_centers_, centers)
            assert found.start_ == "box"
        else:
            lost += 1
            assert found.start_ != "box"
    # The starts on the box lose places in some of these draws, else nothing is tested.
    assert lost > 0


def test_places_too_near_to_tell_apart_are_kept_where_recordings_tell():
    rng = np.random.default_rng(1)
    places = np.vstack([BOX, BOX[0] + [0.02, 0.0, 0.0]])
    x, which = held(rng, places, spread=0.005)
    found = BoundingBoxKMeans(11).fit(x, groups=which)
    assert len(set(homes(found.labels_, which))) == 11


def test_points_that_were_skipped_stay_empty_where_recordings_tell():
    rng = np.random.default_rng(13)
    places = (BOX + rng.normal(scale=0.06, size=BOX.shape))[:8]
    which = np.repeat(np.arange(8), 60)
    x = places[which] + rng.normal(scale=0.006, size=(480, 3))
    found = BoundingBoxKMeans(10).fit(x, groups=which)
    assert found.start_ == "groups"
    assert len(set(homes(found.labels_, which))) == 8
    assert (found.counts_ == 0).sum() == 2


def test_groups_change_nothing_where_the_box_kept_every_place():
    x, which = held(np.random.default_rng(2), BOX)
    alone, told = (BoundingBoxKMeans().fit(x, groups=g) for g in (None, which))
    assert alone.start_ == told.start_ == "box"
    assert np.array_equal(alone.cluster_centers_, told.cluster_centers_)


def test_more_places_than_points_are_named():
    x, _ = held(np.random.default_rng(3), BOX)
    q = np.random.default_rng(4).uniform(-0.5, 0.5, (len(x), 1)) * [0.8, 0.6]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        NullSpaceMap(9).fit(x, q)
    told = [str(one.message) for one in caught if one.category is MapWarning]
    assert "two places share one PCA point: (" in told[0]
    assert "has 0, as it lies between two places" in told[1]


def test_fewer_places_than_points_are_not_blamed_on_short_rests():
    x, _ = held(np.random.default_rng(5), BOX[:8])
    q = np.random.default_rng(4).uniform(-0.5, 0.5, (len(x), 1)) * [0.8, 0.6]
    with pytest.warns(MapWarning, match="2 have 0, as the hand was not held there"):
        learned = NullSpaceMap(10).fit(x, q)
    assert len(learned.centers_) == 8


@pytest.mark.parametrize(
    "spread", [(0.01, 0.01, 0.01), (0.03, 0.002, 0.002), (0.02, 0.02, 0.001)]
)
def test_one_place_is_one_whatever_its_shape(spread):
    rng = np.random.default_rng(6)
    for draw in (rng.normal, rng.uniform):
        x = draw(size=(400, 3)) * spread
        assert two_places(x, least=40, across=0.5) is None


def test_two_places_are_found_with_what_was_seen_on_the_way():
    rng = np.random.default_rng(7)
    x, _ = held(rng, np.array([[0.0, 0, 0], [0.08, 0, 0]]))
    both = two_places(x, least=10, across=0.5)
    # Medians of 60 samples of 6 mm: 1 mm each.
    assert np.allclose(np.sort(np.array(both)[:, 0]), [0.0, 0.08], atol=0.005)


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        (np.zeros(3, int), "group of each of"),
        (np.zeros(len(BOX)), "integer"),
        (np.arange(len(BOX)), "at most 4 groups"),
    ],
)
def test_groups_that_do_not_match_are_refused(groups, words):
    with pytest.raises(InvalidInput, match=words):
        BoundingBoxKMeans(4).fit(BOX, groups=groups)


def test_a_recording_of_one_place_says_so():
    rng = np.random.default_rng(8)
    still = rng.normal(scale=0.005, size=(100, 3))
    hands = [still, still + [0.2, 0, 0], still + [0.01, 0, 0], np.vstack([still, BOX])]
    known = recorded_places([*hands[:3], hands[3][50:], np.empty((0, 3))], n_points=4)
    assert known[::100][:3].tolist() == [0, 1, 0]
    assert set(known[300:]) == {-1}
    assert set(recorded_places(hands[:2], n_points=1)) == {-1}
