"""Our d' and mixed models are right on the inputs that they are measured with; a rival has an error of its own."""

from benchmarks.statistics import sensitivity


def test_each_method_has_its_error() -> None:
    for case in sensitivity.cases(quick=True):
        error = case.error(case.run())
        assert error is not None
        if case.method == sensitivity.OURS:
            assert error < (1e-3 if case.case == "binomial mixed model" else 1e-9), case
        elif case.method.startswith("statsmodels"):
            assert error > 1e-3  # variational, not maximum likelihood
