"""What a comparison is worth as a check: fitted to the data, kept, or contradicted."""

import msgspec
import pytest

from tests.diagnose.scene import mount, record
from thrustd.diagnose.compare.check import check_of
from thrustd.diagnose.compare.compare import compare
from thrustd.identify.artifact import data_sha256
from thrustd.model.artifact import LedgerEntry

PROMISED = LedgerEntry("creep", 50.0, 10.0, "measured", "")


@pytest.mark.parametrize(("rmse", "contradicted"), [(9.0, False), (19.0, False), (21.0, True), (87.0, True)])
def test_twice_the_promise_contradicts(rmse, contradicted):
    model = msgspec.structs.replace(mount(), ledger=[PROMISED])
    found = check_of("better", model, record([], n=2000), rmse, "N")
    assert found.contradicted == contradicted and not found.fitted
    assert ("10.0 N was promised when creep was added" in found.sentence) == contradicted


def test_a_model_without_a_promise_breaks_none():
    assert check_of("bench", mount(), record([], n=2000), 500.0, "N").sentence == ""


def test_what_a_model_was_fitted_to_is_known_under_any_name():
    data = record([], n=2000)
    model = msgspec.structs.replace(mount(), provenance={"extended_on": [f"run 7.csv {data_sha256(data)}"]})
    report = compare({"better": model}, [data])
    assert report.comparisons[0].check.fitted
    assert any("was fitted to this recording" in line for line in report.remarks)
