"""What scikit-learn asks of an estimator, without importing scikit-learn.

A map that is read from a file and evaluated needs nothing of scikit-learn, whose import
takes longer than most commands; only fitting does.
"""

from __future__ import annotations

import inspect
from typing import Any, Self

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

    def _check_fitted(self) -> None:
        """Raise scikit-learn's error unless it is fitted."""
        if not hasattr(self, self._fitted):
            from sklearn.exceptions import NotFittedError

            raise NotFittedError(f"call fit of this {type(self).__name__} first.")
