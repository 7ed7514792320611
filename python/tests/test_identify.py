"""From a record to a report."""

import ast
import json
import os
import pathlib
import signal
import threading
import time

import numpy as np
import pandas
import polars
import pytest

import servobee
from distributed import Client, LocalCluster
from servobee import _calls, _options


def without_times(report):
    return {
        name: value
        for name, value in report.to_dict().items()
        if name not in ("seconds", "date", "records", "arguments", "warnings")
    }


def test_every_field_of_the_report_is_an_attribute(report):
    assert report.verdict == "found"
    assert report.effect_names == ["delay"]
    assert report.effects[0].name == "delay"
    for name, value in report.to_dict().items():
        assert json.loads(json.dumps(getattr(report, name))) == value
    assert report.error.after.hold_out.spool.rmse < report.error.before.hold_out.spool.rmse
    with pytest.raises(AttributeError, match="there is no colour"):
        report.colour


def test_tables_are_frames(report):
    parameters = report.parameters_frame.set_index("name")
    assert abs(parameters.value["delay"] - 0.0047) < 5e-5
    assert parameters.low["gain"] < 250 < parameters.high["gain"]
    errors = report.errors_frame
    assert set(errors.model) == {"before", "after"} and set(errors.data) == {"fit", "hold_out"}
    residuals = report.residuals_frame
    after = residuals["spool measured [V]"] - residuals["spool after [V]"]
    held = residuals.part == "hold_out"
    rmse = np.sqrt(np.mean(after[held] ** 2))
    assert rmse == pytest.approx(report.error.after.hold_out.spool.rmse, rel=1e-9)
    assert "rated flow" in " ".join(report.card_frame.label)


def test_the_page_is_shown_and_the_files_are_written(report, tmp_path):
    assert "<iframe srcdoc=" in report._repr_html_()
    report.save(tmp_path / "result")
    assert sorted(os.listdir(tmp_path / "result")) == sorted(report.contents)
    with pytest.raises(servobee.InputError, match="exists"):
        report.save(tmp_path / "result")
    report.save(tmp_path / "result", force=True)


def test_frames_and_arrays_are_records_as_files_are(plain, table):
    arrays = {label: table[label].to_numpy() for label in table.columns}
    for record in (
        table,
        table.set_index("time [s]"),
        table.convert_dtypes(),
        polars.from_pandas(table),
        arrays,
        table.to_records(index=False),
    ):
        again = servobee.identify(record, effects="none", device="cpu")
        assert without_times(again) == without_times(plain)
    single = {label: values.astype(np.float32) for label, values in arrays.items()}
    of_single = servobee.identify(single, effects="none", device="cpu").parameters_frame
    np.testing.assert_allclose(of_single.value, plain.parameters_frame.value, rtol=1e-3)


@pytest.mark.parametrize("dtype", ["Float64", "object", "masked"])
def test_what_is_missing_in_a_column_is_refused_or_left_out(table, dtype):
    if dtype == "masked":
        gap = {label: np.ma.masked_array(table[label], mask=False) for label in table.columns}
        gap["spool [V]"][17] = np.ma.masked
    else:
        gap = table.astype({"spool [V]": dtype})
        gap.loc[17, "spool [V]"] = None
    with pytest.raises(servobee.InputError, match="row 19.*spool"):
        servobee.identify(gap)
    with pytest.warns(UserWarning, match="skipped 1 incomplete row, the first at row 19"):
        servobee.identify(gap, skip_incomplete_rows=True, effects="none", device="cpu")


def test_maps_name_the_columns_of_others(table):
    other = table.rename(columns={label: f"c{k}" for k, label in enumerate(table.columns)})
    maps = {f"c{k}": label for k, label in enumerate(table.columns)}
    found = servobee.identify(other, maps=maps, effects="none", device="cpu")
    assert found.verdict == "not_diagnosed"
    assert "effects=none" in found.arguments and any("c0" in one for one in found.arguments)
    with pytest.raises(servobee.InputError, match="time"):
        servobee.identify(other)
    with pytest.raises(servobee.InputError, match='"nowhere"'):
        servobee.identify(table, maps={"nowhere": "flow [L/min]"})


def test_what_is_wrong_is_refused_with_cause_and_remedy(table, tmp_path):
    bad = table.copy()
    bad.loc[17, "command [V]"] = np.nan
    for records, words in [
        (str(tmp_path / "nothing.csv"), "nothing.csv"),
        (bad, "command"),
        (table.drop(columns=["command [V]"]), "command"),
        ({"time [s]": [0.0, 1.0], "command [V]": [1.0]}, "give one value for each row"),
        ({"time [s]": np.zeros((3, 2))}, "2 dimensions"),
        ({"time [s]": np.zeros(3, complex)}, "complex"),
        (table.to_numpy(), "an array whose fields have names"),
        ([], "there are none"),
        (3.5, "is a float"),
    ]:
        with pytest.raises(servobee.InputError, match=words) as refused:
            servobee.identify(records)
        assert isinstance(refused.value, ValueError)
        assert refused.value.problem and refused.value.remedy
    for options, words in [
        ({"effects": "dealy"}, "there is no effect"),
        ({"hold_out_share": 2}, "0.05 to 0.9"),
        ({"hold_out_share": "much"}, "hold_out_share: is 'much'"),
        ({"max_rows": 10}, "from 1000 on"),
        ({"max_rows": -10}, "max_rows: is -10"),
        ({"units": "stone"}, "stone"),
        ({"effects": None}, "effects: is None"),
        ({"maps": 3}, "maps: is a int"),
        ({"hold_out": [table, bad]}, "held-out table 2, row 19"),
        ({"full_scale": -1.0}, "above zero"),
        ({"device": "tpu"}, "auto, cpu, gpu"),
        ({"model": "gain = 3"}, "model"),
        ({"limits": {"colour": "<= 3"}}, "colour"),
    ]:
        with pytest.raises(servobee.InputError, match=words):
            servobee.identify(table, **options)
    with pytest.raises(TypeError, match="no option 'max_effect'"):
        servobee.identify(table, max_effect=1)


def test_datetimes_are_times(table):
    dated = table.rename(columns={"time [s]": "time"})
    dated["time"] = pandas.Timestamp("2024-03-14T10:22:31") + pandas.to_timedelta(table["time [s]"], unit="s")
    found = servobee.identify(dated, effects="delay", device="cpu")
    assert found.effect_names == ["delay"]


def test_several_devices_find_what_one_does(plain, bench):
    found = servobee.identify(bench, effects="none", device="cpu+cpu")
    assert found.evaluator == f"2 devices, each on {plain.evaluator}"
    np.testing.assert_array_equal(found.parameters_frame.value, plain.parameters_frame.value)


def test_progress_is_told_and_an_exception_in_it_stops_the_run(bench):
    stages = []
    servobee.identify(bench, effects="none", device="cpu", progress=stages.append)
    assert stages[0].startswith("base model") and stages[-1] == "valve card"
    with pytest.raises(ZeroDivisionError):
        servobee.identify(bench, progress=lambda stage: 1 / 0)


def test_a_bar_of_tqdm_is_shown(bench, capfd):
    servobee.identify(bench, effects="none", device="cpu", progress=True)
    assert "identify" in capfd.readouterr().err


def test_ctrl_c_stops_a_run_and_other_threads_go_on(bench):
    begun = time.monotonic()
    seen = []

    def interrupt():
        time.sleep(0.5)
        seen.append(time.monotonic() - begun)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        while True:
            servobee.identify(bench, device="cpu")
    thread.join()
    # Had the lock been held, the thread would have slept on.
    assert seen and seen[0] < 5


def test_a_comparison_says_what_changed(table):
    other = table.copy()
    other["spool [V]"] += 0.5
    found = servobee.compare(table, other, effects=["delay", "sensor_offset"], device="cpu")
    assert found.answer.startswith("sensor_offset.spool came")
    assert found.before and "<iframe" in found._repr_html_()


def test_a_batch_has_a_row_for_every_file(bench, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("time [s],command [V]\n0,1\n1,x\n")
    found = servobee.batch([bench, bad], tmp_path / "out", effects="none", device="cpu")
    assert [row.status for row in found.rows] == ["ok", "refused"]
    assert (tmp_path / "out" / "index.html").is_file()


@pytest.fixture(scope="session")
def client():
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        yield client


def overview(folder):
    """What a batch has written, but for when and how fast."""
    batch = json.loads((folder / "batch.json").read_text())
    date = batch.pop("date")
    for row in batch["rows"]:
        del row["seconds"]
    page = (folder / "index.html").read_text().replace(date, "")
    rows = [line.split(",") for line in (folder / "batch.csv").read_text().splitlines()]
    seconds = rows[0].index("seconds")
    return batch, page, [row[:seconds] + row[seconds + 1 :] for row in rows], sorted(os.listdir(folder))


@pytest.fixture
def records(table, tmp_path):
    """A folder of short records, one of which is refused."""
    folder = tmp_path / "records"
    folder.mkdir()
    for number in range(5):
        table[number * 100 : number * 100 + 1500].to_csv(folder / f"valve{number}.csv", index=False)
    (folder / "bad.csv").write_text("nothing")
    return folder


def test_a_batch_on_the_workers_of_dask_has_the_same_overview(records, client, tmp_path):
    options = {"effects": "none", "device": "cpu", "seed": 3}
    stages = []
    servobee.batch(records, tmp_path / "whole", **options)
    found = servobee.batch(records, tmp_path / "spread", client=client, progress=stages.append, **options)
    assert [row.status for row in found.rows] == ["refused"] + 5 * ["ok"]
    assert overview(tmp_path / "spread") == overview(tmp_path / "whole")
    # The workers have done it, not the call that gathers.
    assert "16/16 tasks" in stages and not any("valve" in stage for stage in stages)
    with pytest.raises(servobee.InputError, match="exists"):
        servobee.batch(records, tmp_path / "spread", client=client, **options)
    servobee.batch(records, tmp_path / "spread", client=client, force=True, **options)
    with pytest.raises(servobee.InputError, match="leave one of the two out"):
        servobee.batch(records, tmp_path / "other", client=client, task="1/2", **options)
    with pytest.raises(servobee.InputError, match="out/of"):
        servobee.batch(records, tmp_path / "other", task="out/of", **options)
    assert not (tmp_path / "other").exists()


def test_the_readme_has_the_call():
    readme = (pathlib.Path(__file__).parent.parent.parent / "README.md").read_text()
    assert 'servobee.batch("records", "result", client=client)' in readme


def test_a_worker_that_dies_is_made_up_for(records, client, tmp_path):
    options = {"effects": "none", "device": "cpu"}
    servobee.batch(records, tmp_path / "whole", **options)
    killed = []

    def kill(stage):
        if not killed:
            killed.extend(client.run(os.getpid).values())
            os.kill(killed[0], signal.SIGKILL)

    servobee.batch(records, tmp_path / "spread", client=client, progress=kill, **options)
    assert overview(tmp_path / "spread") == overview(tmp_path / "whole")
    assert killed


def test_the_curve_of_a_datasheet_is_fitted(tmp_path):
    curve = tmp_path / "flow.csv"
    curve.write_text("opening [%],flow [L/min]\n" + "".join(f"{at},{0.1 * at}\n" for at in range(0, 101, 20)))
    stages = []
    found = servobee.datasheet(flow=curve, device="cpu", progress=stages.append)
    rated = next(one for one in found.card if one.name == "rated_flow")
    assert rated.value == pytest.approx(10, rel=1e-4)
    assert "generation" in stages[0] and "points.csv" in found.contents
    with pytest.raises(servobee.InputError, match="a number from 1 to 400"):
        servobee.datasheet(flow=curve, drop=0)
    with pytest.raises(servobee.InputError, match="give d675, kbfdg5v"):
        servobee.datasheet(case="D674")


def test_a_model_is_simulated_and_exported(report, table, tmp_path):
    simulated = servobee.simulate(report, table)
    spool = next(one for one in simulated.channels if one.name == "spool")
    assert spool.fit_percent > 98
    assert len(simulated.frame) == len(table)
    servobee.export(report, tmp_path / "valve.mo")
    assert "model" in (tmp_path / "valve.mo").read_text()
    with pytest.raises(servobee.InputError, match="names no format"):
        servobee.export(report, tmp_path / "valve.xyz")


def test_a_made_up_record_has_what_was_planted():
    record = servobee.synthesize("delay=0.004", seconds=4, seed=3)
    found = servobee.identify(record, effects=["delay", "null_bias"], device="cpu")
    assert found.effect_names == ["delay"]
    with pytest.raises(servobee.InputError, match='meter: is "tank"; give load, supply'):
        servobee.synthesize(meter="tank")
    assert {one.name for one in servobee.effects()} >= {"delay", "hysteresis"}


def test_the_stubs_name_every_option():
    stubs = ast.parse((pathlib.Path(servobee.__file__).parent / "__init__.pyi").read_text())
    typed = {one.name: {arg.arg for arg in one.args.kwonlyargs} for one in stubs.body if isinstance(one, ast.FunctionDef)}
    for name, own in [("identify", set()), ("compare", set()), ("batch", {"baseline", "force", "resume", "task", "client"})]:
        given = set(_options.OPTIONS) | own | {"maps", "model", "effects", "progress"}
        assert typed[name] == given, name
    assert typed["synthesize"] == set(_calls.SYNTHESIZE)
    assert typed["datasheet"] == set(_calls.DATASHEET) | {"progress"}
    assert set(servobee.__all__) - set(typed) == {one for one in servobee.__all__ if one[0].isupper()}
