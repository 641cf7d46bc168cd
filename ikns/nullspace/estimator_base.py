"""What scikit-learn asks of an estimator, without importing scikit-learn.

The import of scikit-learn takes longer than most commands. Neither a map that is read
from a file needs it, nor one that is fitted to arrays in which it would find no fault.
"""

from __future__ import annotations

import inspect
from typing import Any, Self, TypeGuard

import numpy as np

from ikns.arrays import Array
from ikns.errors import InvalidInput


class EstimatorBase:
    """Parameters, tags and text of an estimator, by scikit-learn's conventions.

    A subclass stores each parameter of its constructor under the same name.
    """

    #: Columns of what it was fitted to.
    n_features_in_: int
    #: An attribute that it has once it is fitted.
    _fitted = "interpolator_"
    #: Whether `y` holds vectors; else a number a sample.
    _vectors = True

    @classmethod
    def _parameter_names(cls) -> list[str]:
        return [name for name in inspect.signature(cls).parameters]

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the parameters by name; `deep` is for nested estimators."""
        return {name: getattr(self, name) for name in sorted(self._parameter_names())}

    def set_params(self, **params: Any) -> Self:
        """Set parameters.

        Raises
        ------
        InvalidInput
            When there is no such parameter.
        """
        known = self._parameter_names()
        for name, value in params.items():
            if name not in known:
                raise InvalidInput(
                    f"expected one of the parameters {', '.join(known)}, found {name}."
                )
            setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        """Name the parameters that are not the defaults."""
        given = [
            f"{name}={value!r}"
            for name, parameter in inspect.signature(type(self)).parameters.items()
            if (value := getattr(self, name)) is not parameter.default
        ]
        return f"{type(self).__name__}({', '.join(given)})"

    def __sklearn_tags__(self) -> Any:
        """Tell scikit-learn that `y` is needed, and what it holds."""
        from sklearn.utils import InputTags, Tags, TargetTags

        target = TargetTags(
            required=True,
            multi_output=self._vectors,
            single_output=not self._vectors,
        )
        return Tags(estimator_type=None, target_tags=target, input_tags=InputTags())

    def _validated(self, X: Any, *y: Any, **options: Any) -> Any:
        """Return samples, and targets if any are given, as scikit-learn checks them.

        Arguments are those of `sklearn.utils.validation.validate_data`, which is asked
        only where it could change an array or refuse it.
        """
        reset = options.get("reset", True)
        plain = _is_plain(X) and X.ndim == 2 and not hasattr(self, "feature_names_in_")
        if plain and not reset:
            plain = X.shape[1] == self.n_features_in_
        if plain and y:
            most = 2 if options.get("multi_output") else 1
            plain = _is_plain(y[0]) and y[0].ndim <= most and len(y[0]) == len(X)
        if not plain:
            from sklearn.utils.validation import validate_data

            return validate_data(self, X, *y, **options)
        if reset:
            self.n_features_in_ = X.shape[1]
        return (X, *y) if y else X

    def _check_fitted(self) -> None:
        """Raise scikit-learn's error unless it is fitted."""
        if not hasattr(self, self._fitted):
            from sklearn.exceptions import NotFittedError

            raise NotFittedError(f"call fit of this {type(self).__name__} first.")


def _is_plain(x: Any) -> TypeGuard[Array]:
    """Whether it is an array of finite 64-bit numbers with nothing missing."""
    return (
        type(x) is np.ndarray
        and x.dtype == np.float64
        and x.ndim > 0
        and x.size > 0
        and bool(np.isfinite(x).all())
    )
