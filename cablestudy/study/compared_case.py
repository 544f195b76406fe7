"""A case whose numbers by stated elements are compared with those of a finer model, to estimate their errors."""

from functools import cached_property

import numpy as np

from cablestudy.errors import CablestudyError
from cablestudy.study.column import value_and_error
from cablestudy.system.comparison import relative


class ComparedCase:
    """Part of `CableCase` and `SuspensionCase`: comparison with `finer`, a case to `STUDY.reference_accuracy`."""

    estimate = False  # whether errors are to be estimated so
    reason = ""  # why an error in `differences` is not known

    @cached_property
    def differences(self):
        """Header -> relative error, to be filled: dict."""
        return {}

    def difference_from_finer(self, column, number):
        """Relative difference of a number from that of `finer`, plus the error of that; NaN if not known. [-]"""
        self.differences[column.header] = None
        try:
            reference, reference_error = value_and_error(column, self.finer)
        except CablestudyError as error:
            self.reason = str(error)
            return np.nan
        self.differences[column.header] = relative(number, reference) + np.nan_to_num(reference_error or 0.0)
        return self.differences[column.header]
