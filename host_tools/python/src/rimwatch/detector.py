# SPDX-License-Identifier: MIT
"""The monitor as a detector of scikit-learn."""

from __future__ import annotations

from typing import Any, Iterable, List, Optional

import numpy as np
import pandas as pd
from sklearn.base import BaseEstimator, OutlierMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from . import _core
from .monitor import Monitor, train


def _roles(names: Iterable[Any]) -> List[str]:
    return [str(n) if str(n).startswith(("x.", "u.", "s.")) else f"s.{n}" for n in names]


class RimDetector(OutlierMixin, BaseEstimator):
    """Learns healthy runs, and says of every row of another run whether a deviation was in it.

    Rows of X [n_samples, n_features] are one after another in time, period_s apart; columns of a
    DataFrame keep their roles (`u.` is a command), any other column is a sensor. runs: how many
    runs of equal length X is cut into where fit gets no `groups`, at least 3.

    >>> import numpy as np, rimwatch
    >>> logs = rimwatch.example_logs(20)
    >>> X = np.concatenate([log.to_numpy() for log in logs])
    >>> detector = rimwatch.RimDetector(runs=20).fit(X)
    >>> y = detector.predict(rimwatch.example_logs(1, first=21, bias=0.3)[0].to_numpy())
    >>> bool((y[400:] == -1).mean() > 0.9), bool((y[:250] == -1).mean() < 0.2)
    (True, True)
    """

    def __init__(self, runs: int = 5, period_s: float = 0.1, false_alarm: float = 0.05) -> None:
        self.runs = runs
        self.period_s = period_s
        self.false_alarm = false_alarm

    def fit(self, X: Any, y: Any = None, groups: Optional[Any] = None) -> "RimDetector":
        """groups: the run of every row, [n_samples]; rows of a run follow one another.

        >>> import pandas as pd, rimwatch
        >>> X = pd.concat(rimwatch.example_logs(4), ignore_index=True)
        >>> rimwatch.RimDetector().fit(X, groups=X.index // 600).image_.outcomes
        ['s.speed_mps', 's.current_A']
        """
        named = list(X.columns) if isinstance(X, pd.DataFrame) else None
        X = validate_data(self, X, dtype="float64", ensure_min_samples=2)
        names = self._columns = _roles(named or range(X.shape[1]))
        if groups is None:
            groups = np.arange(len(X)) * max(int(self.runs), 1) // len(X)
        groups = np.asarray(groups)
        frames = [self._frame(X[groups == g], names) for g in pd.unique(groups)]
        try:
            self.image_ = train(frames, false_alarm=self.false_alarm)
        except _core.DataError as reason:
            what = f"n_samples={len(X)}: cannot learn from these runs: {reason}"
            raise ValueError(what) from None
        self.offset_ = -float(self.image_.facts["alarm_score"])
        return self

    def score_samples(self, X: Any) -> np.ndarray:
        """Minus the monitor's score at every row, [n_samples]: lower is more deviant.

        >>> import numpy as np, rimwatch
        >>> X = np.concatenate([log.to_numpy() for log in rimwatch.example_logs(20)])
        >>> detector = rimwatch.RimDetector(runs=20).fit(X)
        >>> run = rimwatch.example_logs(1, first=21)[0].to_numpy()
        >>> bool((detector.score_samples(run) > detector.offset_).all())
        True
        """
        return -self._run(X).rows["score"].to_numpy()

    def decision_function(self, X: Any) -> np.ndarray:
        """Below 0 where the score is above the one that raises an alarm.

        >>> import numpy as np, rimwatch
        >>> X = np.concatenate([log.to_numpy() for log in rimwatch.example_logs(20)])
        >>> detector = rimwatch.RimDetector(runs=20).fit(X)
        >>> run = rimwatch.example_logs(1, first=21)[0].to_numpy()
        >>> bool((detector.decision_function(run) > 0).all())
        True
        """
        return self.score_samples(X) - self.offset_

    def predict(self, X: Any) -> np.ndarray:
        """-1 for the rows in which a deviation was that an alarm found, 1 for all others.

        >>> import numpy as np, rimwatch
        >>> X = np.concatenate([log.to_numpy() for log in rimwatch.example_logs(20)])
        >>> detector = rimwatch.RimDetector(runs=20).fit(X)
        >>> run = rimwatch.example_logs(1, first=21)[0].to_numpy()
        >>> bool((detector.predict(run) == 1).all())
        True
        """
        return np.where(self._run(X).rows["finding"].to_numpy() > 0, -1, 1)

    def _run(self, X: Any):
        check_is_fitted(self)
        X = validate_data(self, X, dtype="float64", reset=False)
        return Monitor(self.image_).run(self._frame(X, self._columns))

    def _frame(self, X: np.ndarray, names: List[str]) -> pd.DataFrame:
        index = pd.Index(np.round(np.arange(len(X)) * self.period_s, 9), name="t_s")
        return pd.DataFrame(X, columns=names, index=index)
