"""Laws of the natural posture: a ridge toward other people, held where taught."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV

from ikns.errors import InvalidInput
from ikns.nullspace.local_posture import REACH
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.people_posture import natural_posture_people
from ikns.nullspace.posture_terms import quadratic_terms

LOW, HIGH = np.array([0.1, -0.4, 0.0]), np.array([0.45, 0.1, 0.4])


def movement(seed, *, n=400, noise=0.03):
    rng = np.random.default_rng(seed)
    wrist = rng.uniform(LOW, HIGH, (n, 3))
    turned = 0.4 * np.sin(6 * wrist[:, 0]) + wrist[:, 1] - 2 * wrist[:, 2] ** 2
    return wrist, turned + 0.6 + rng.normal(scale=noise, size=n)


def test_terms_are_the_quadratic_of_the_formula():
    x, y, z = 1.0, -2.0, 0.5
    w = np.array([0.25, -0.15, 0.20]) + 0.2 * np.array([x, y, z])
    expected = [1, x, y, z, x * x, y * y, z * z, x * y, x * z, y * z]
    assert np.allclose(quadratic_terms(w), expected, atol=1e-12)


def test_it_is_a_ridge_toward_the_people_that_ship():
    wrist, s = movement(1)
    people = natural_posture_people().wrist_alone
    phi = quadratic_terms(wrist)
    # Scikit-learn's ridge has a free intercept too; its penalty is N times ours.
    other = Ridge(alpha=0.03 * len(s)).fit(phi[:, 1:], s - phi @ people)
    own = NaturalPosture(guard=False, local_penalty=None).fit(wrist, s)
    at, _ = movement(2, n=50)
    expected = quadratic_terms(at) @ people + other.predict(quadratic_terms(at)[:, 1:])
    assert np.allclose(own.swivel(at), expected, rtol=0, atol=1e-10)


def with_hand(seed, *, n=400):
    """Places with a hand that points about forward, and swivels that follow it."""
    wrist, s = movement(seed, n=n)
    rng = np.random.default_rng([seed, 1])
    way = [1.0, -0.3, 0.1] + rng.normal(scale=0.5, size=(n, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return np.hstack([wrist, way]), s + way @ [0.3, -0.2, 0.4]


@given(st.integers(0, 100))
@settings(max_examples=10, deadline=None)
def test_the_hand_is_in_the_ridge_too(seed):
    places, s = with_hand(seed)
    known, n = natural_posture_people(), len(s)
    phi = np.hstack([quadratic_terms(places[:, :3]), places[:, 3:]])
    # Least squares on rows: those of the penalty meet zero.
    rows = np.vstack([phi / np.sqrt(n), np.sqrt(0.03) * np.eye(13)[1:]])
    aims = np.r_[(s - phi @ known.mean) / np.sqrt(n), np.zeros(12)]
    beyond = np.linalg.lstsq(rows, aims, rcond=None)[0]
    own = NaturalPosture(guard=False, local_penalty=None).fit(places, s)
    assert np.allclose(own.coefficients_, known.mean + beyond, rtol=0, atol=1e-9)
    assert np.allclose(own.swivel(places), phi @ own.coefficients_, atol=1e-9)


def test_the_hand_has_no_say_in_where_was_taught_and_what_is_remembered():
    places, s = with_hand(1)
    own = NaturalPosture().fit(places, s)
    turned = places * [1, 1, 1, -1, -1, -1]
    assert np.array_equal(own.taught(turned), own.taught(places))
    follows = places[:, 3:] @ own.coefficients_[10:]
    change = own.swivel(turned) - own.swivel(places)
    assert np.allclose(change, -2 * follows, atol=1e-12)
    alone = NaturalPosture().fit(places[:, :3], s)
    assert np.array_equal(alone.swivel(turned), alone.swivel(places[:, :3]))
    assert NaturalPosture.of_people(hand=True).swivel(places).shape == (400,)


@given(st.integers(0, 100), st.floats(-1.0, 1.0))
@settings(max_examples=10, deadline=None)
def test_an_offset_of_one_s_own_is_free(seed, offset):
    wrist, s = movement(seed, n=60)
    plain, shifted = (NaturalPosture().fit(wrist, s + d) for d in (0.0, offset))
    at, _ = movement(seed + 1, n=20)
    assert np.allclose(shifted.swivel(at), plain.swivel(at) + offset, atol=1e-9)
    assert np.isclose(shifted.offset_, plain.offset_ + offset)


@given(st.integers(0, 100))
@settings(max_examples=10, deadline=None)
def test_far_away_it_is_other_people_and_one_s_offset(seed):
    wrist, s = movement(seed, n=200)
    own = NaturalPosture(guard=True).fit(wrist, s)
    people = NaturalPosture.of_people()
    away = np.array([0.3, -0.1, 0.2]) + 3.0 * np.eye(3)
    bare = NaturalPosture(guard=False).fit(wrist, s)
    from_people = np.abs(own.swivel(away) - people.swivel(away) - own.offset_)
    assert not own.taught(away).any()
    # A quadratic grows by the square of the way, and so does the leverage.
    assert (from_people < 0.2 * np.abs(bare.swivel(away) - s.mean()).max() + 1).all()


def far_apart(seed):
    """Wrists at 5 cm or more from each other, so that each has a bump of its own."""
    rng = np.random.default_rng(seed)
    grid = np.array(list(np.ndindex(4, 4, 3)))[rng.permutation(48)[:40]]
    wrist = LOW + 0.07 * grid + rng.uniform(0, 0.02, (40, 3))
    return wrist, rng.normal(scale=0.1, size=40)


@given(st.integers(0, 100), st.floats(1e-4, 0.1))
@settings(max_examples=10, deadline=None)
def test_places_are_remembered_by_kernel_ridge(seed, penalty):
    wrist, s = far_apart(seed)
    smooth, own = (
        NaturalPosture(local_penalty=p).fit(wrist, s) for p in (None, penalty)
    )
    at = np.vstack([wrist, far_apart(seed + 1)[0]])

    def kernel(a):
        r = np.clip(np.linalg.norm(a[:, None] - wrist, axis=2) / REACH, 0, 1)
        return (1 - r) ** 4 * (4 * r + 1)

    # Scikit-learn's penalty is of the sum, ours of the mean.
    ridge = KernelRidge(alpha=penalty * len(s), kernel="precomputed")
    bare = NaturalPosture(local_penalty=None, guard=False).fit(wrist, s)
    ridge.fit(kernel(wrist), s - bare.swivel(wrist))
    expected = smooth.swivel(at) + ridge.predict(kernel(at))
    # Normal equations square the condition of K, some 1e3 here.
    assert np.allclose(own.swivel(at), expected, rtol=0, atol=1e-7)


def test_a_place_that_was_never_near_is_not_touched():
    wrist, s = far_apart(1)
    smooth, own = (NaturalPosture(local_penalty=p).fit(wrist, s) for p in (None, 0.01))
    away = wrist[:, None] + 10 * REACH * np.eye(3)
    away = away[(np.linalg.norm(away[..., None, :] - wrist, axis=-1) > REACH).all(-1)]
    assert len(away) > 50
    assert np.array_equal(own.swivel(away), smooth.swivel(away))
    assert np.abs(own.swivel(wrist) - smooth.swivel(wrist)).max() > 0.02


def test_where_it_was_taught_the_guard_changes_nothing():
    wrist, s = movement(3)
    own, bare = (NaturalPosture(guard=g).fit(wrist, s) for g in (True, False))
    taught = own.taught(wrist)
    assert taught.mean() == pytest.approx(0.99, abs=0.01)
    at = wrist[taught]
    assert np.allclose(own.swivel(at), bare.swivel(at), rtol=0, atol=1e-12)


def test_the_guard_is_continuous_at_the_border():
    wrist, s = movement(4)
    own = NaturalPosture(guard=True).fit(wrist, s)
    line = np.array([0.3, -0.1, 0.2]) + np.linspace(0, 1, 20001)[:, None] * [1, 1, 1]
    assert own.taught(line)[0]
    assert not own.taught(line)[-1]
    # Steps of 0.09 mm; slopes stay below 20 rad/m there.
    assert np.abs(np.diff(own.swivel(line))).max() < 2e-3


def test_missing_places_give_missing_postures():
    own = NaturalPosture.of_people()
    assert np.isnan(own.swivel([[np.nan, 0, 0], [0.3, -0.1, 0.2]])).tolist() == [
        True,
        False,
    ]


def test_people_name_source_and_license_and_are_a_population():
    people = natural_posture_people()
    assert "UE_ADL" in people.source
    assert people.license.startswith("MIT")
    assert people.arms == 14
    # Rounded to 1e-6.
    assert np.linalg.eigvalsh(people.covariance).min() > -1e-5
    assert np.allclose(people.covariance, people.covariance.T)


def test_it_can_be_chosen_by_cross_validation():
    wrist, s = movement(5, n=120)
    search = GridSearchCV(NaturalPosture(), {"penalty": [0.003, 0.03, 10.0]}, cv=3)
    search.fit(wrist, s)
    assert search.best_params_["penalty"] < 10.0
    assert 0.5 < search.best_score_ <= 1.0


def test_wrong_parameters_and_arrays_are_refused():
    wrist, s = movement(6, n=20)
    with pytest.raises(InvalidInput, match="penalty above 0"):
        NaturalPosture(penalty=0.0).fit(wrist, s)
    with pytest.raises(InvalidInput, match="penalty above 0"):
        NaturalPosture(local_penalty=-1.0).fit(wrist, s)
    own = NaturalPosture().fit(wrist, s)
    with pytest.raises(InvalidInput, match="places of shape"):
        own.swivel(wrist[:, :2])
    arrays = own.coefficients_, own.people_, own.leverage_
    for bad in ((arrays[0][:5], *arrays[1:]), (arrays[0] * np.nan, *arrays[1:])):
        with pytest.raises(InvalidInput, match="expected"):
            NaturalPosture.from_arrays(*bad, taught_leverage=1.0)
    for places, heights in (([[0, 0, 0]], []), ([0, 0, 0], [1]), ([[0, 0]], [1])):
        with pytest.raises(InvalidInput, match="places .* and their heights"):
            NaturalPosture.from_arrays(
                *arrays, taught_leverage=1.0, places=places, heights=heights
            )
    with pytest.raises(InvalidInput, match="leverage above 0"):
        NaturalPosture.from_arrays(*arrays, taught_leverage=0.0)
