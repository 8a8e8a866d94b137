"""Analyses: the answers of the command line as typed objects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
from matplotlib.figure import Figure

import rotary_stand as rs


def test_hidden_effect_is_found_from_a_frame(cogging_log: rs.Log, nominal: rs.Model) -> None:
    answer = rs.explain(cogging_log.to_pandas(), nominal)
    assert (answer.verdict, answer.missing) == ("effect-found", ["cogging"])
    assert answer.model.effects[-1] == "cogging"
    assert answer.candidates[0].effect == "cogging" and answer.candidates[0].delta_bic is not None
    assert set(answer.candidates[0].parameters) == {"cogging_N_m", "cogging_order", "cogging_phase_rad"}
    assert answer.parameters["cogging_order"].value == 8
    assert len(answer.series) > 0 and answer.to_frame()["effect"][0] == "cogging"
    assert "cogging" in answer.text and answer.html.rstrip().endswith("</html>")
    assert "iframe" in answer._repr_html_() and "cogging" in repr(answer)


def test_log_of_the_model_is_adequate(null_log: rs.Log, nominal: rs.Model) -> None:
    answer = rs.explain(null_log, nominal)
    assert (answer.verdict, answer.missing) == ("adequate", [])


def test_compare_fit_and_simulate(cogging_log: rs.Log, nominal: rs.Model, folder: Path) -> None:
    comparison = rs.compare(cogging_log, nominal)
    assert comparison.outputs["omega_rad_s"].ratio > 10 and comparison.misfits[0].share > 0.1
    fit = rs.fit(cogging_log, nominal.add("cogging").update({"cogging_order": 8}))
    assert fit.converged and fit.outputs["omega_rad_s"].ratio < 1.1 and not fit.sigma_is_lower_bound
    inertia = fit.parameters["inertia_kg_m2"]
    assert inertia.sigma is not None and inertia.value == pytest.approx(2.5e-4, rel=0.01)
    assert fit.model["inertia_kg_m2"] == inertia.value and fit.model.remarks is not None
    fit.save_html(folder / "fit.html")
    assert "</html>" in (folder / "fit.html").read_text()
    series = rs.simulate(fit.model, cogging_log).series
    assert np.std(series["omega_rad_s"] - series["omega_rad_s_model"]) < 0.02


def test_sensitivity_is_the_derivative(cogging_log: rs.Log, nominal: rs.Model) -> None:
    step = 1e-4
    at = rs.simulate(nominal, cogging_log)
    for parameter in ("inertia_kg_m2", "motor_constant_N_m_A", "viscous_N_m_s"):
        moved = nominal.copy()
        moved[parameter] *= 1 + step
        difference = (rs.simulate(moved, cogging_log).series["omega_rad_s_model"] - at.series["omega_rad_s_model"]) / (step * nominal[parameter])
        exact = at.sensitivity("omega_rad_s", parameter)
        late = at.series["t_s"] > 2.0  # the initial state is fitted anew to each model
        assert np.corrcoef(difference[late], exact[late])[0, 1] > 0.99
        assert np.std(difference[late]) == pytest.approx(np.std(exact[late]), rel=0.05)
    assert set(at.parameters) == set(nominal.parameters)


def test_several_logs_are_fitted_together(cogging_log: rs.Log, null_log: rs.Log, nominal: rs.Model) -> None:
    assert rs.fit([cogging_log, null_log], nominal).data["samples"] > 20000


def test_expression_uses_a_column_of_the_user(cogging_log: rs.Log, nominal: rs.Model, folder: Path) -> None:
    data = {**cogging_log.to_dict(), "pull": np.sin(8 * cogging_log["theta_rad"])}
    text = nominal.to_toml().replace("[drive]", '[drive]\ncolumns = ["pull"]', 1)
    model = rs.Model.parse(text).add_expression("pulled", "a*pull", parameters={"a": 1e-4})
    assert model.columns == ["pull"]
    assert rs.fit(data, model).outputs["omega_rad_s"].ratio < rs.fit(cogging_log, nominal).outputs["omega_rad_s"].ratio
    log = rs.Log.from_dict(data)
    log.write(folder / "own.parquet")
    assert rs.fit(folder / "own.parquet", model).parameters["pulled.a"].value == pytest.approx(rs.fit(data, model).parameters["pulled.a"].value)
    with pytest.raises(rs.AnalysisError, match="pull"):
        rs.fit(cogging_log, model)


def test_models_and_logs_are_accepted_as_paths(cogging_log: rs.Log, nominal: rs.Model, folder: Path) -> None:
    cogging_log.write(folder / "a.parquet")
    nominal.write(folder / "a.toml")
    ratio = rs.compare(cogging_log, nominal).outputs["omega_rad_s"].ratio
    assert rs.compare(str(folder / "a.parquet"), folder / "a.toml").outputs["omega_rad_s"].ratio == ratio
    assert rs.compare(cogging_log, nominal.to_toml()).outputs["omega_rad_s"].ratio == ratio


def test_errors_of_analyses(cogging_log: rs.Log, nominal: rs.Model) -> None:
    data = cogging_log.to_dict()
    with pytest.raises(rs.AnalysisError, match="u_V"):
        rs.compare({"t_s": data["t_s"], "omega_rad_s": data["omega_rad_s"]}, nominal)
    for model in (None, 3, {"a": 1}):
        with pytest.raises(TypeError):
            rs.compare(cogging_log, model)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="empty"):
        rs.compare([], nominal)
    with pytest.raises(ValueError, match="time_limit_s"):
        rs.fit(cogging_log, nominal, time_limit_s=0)
    with pytest.raises(rs.AnalysisError):
        rs.fit({name: values[:3] for name, values in data.items()}, nominal)
    with pytest.raises(TypeError, match="progress"):
        rs.fit(cogging_log, nominal, progress=3)  # type: ignore[arg-type]


def test_implausible_log_is_an_exception_with_its_report(cogging_log: rs.Log, nominal: rs.Model) -> None:
    data = dict(cogging_log.to_dict())
    for name in ("omega_rad_s", "theta_rad"):
        data[name] = -data[name]
    with pytest.raises(rs.ImplausibleLogError) as caught:
        rs.explain(data, nominal)
    assert caught.value.data["verdict"] == "bad-log" and "</html>" in caught.value.html


def test_allan_deviation_of_white_noise() -> None:
    rows, sigma, dt = 50_000, 1e-4, 0.01
    noise = np.random.default_rng(1).normal(0, sigma, rows)
    log = rs.Log.from_dict({"t_s": np.arange(rows) * dt, "gyro_rad_s": noise})
    answer = rs.allan(log, "gyro_rad_s")
    white = answer.coefficients["white_noise"]
    assert white.value == pytest.approx(sigma * np.sqrt(dt), rel=0.05)
    assert answer.coefficients["bias_instability"].value is None
    assert answer.tau_s.shape == answer.deviation.shape == (len(answer.to_frame()),)
    assert "angle random walk" in answer.quantities
    with pytest.raises(rs.LogError) as caught:
        rs.allan(log, "accel")
    assert caught.value.column == "accel"
    with pytest.raises(rs.AnalysisError):
        rs.allan({"t_s": np.arange(9.0), "gyro_rad_s": np.zeros(9)}, "gyro_rad_s")
    for arguments in ({"taus": "some"}, {"interpretation": "other"}, {"units": "furlong"}):
        with pytest.raises(ValueError):
            rs.allan(log, "gyro_rad_s", **arguments)


def test_allan_deviation_of_a_file_is_that_of_its_log(folder: Path) -> None:
    noise = np.random.default_rng(2).normal(0, 1e-4, 5000)
    rs.Log.from_dict({"t_s": np.arange(5000) * 0.01, "gyro_rad_s": noise}).write(folder / "rest.csv")
    of_file = rs.allan(folder / "rest.csv", "gyro_rad_s", from_s=5.0, to_s=40.0)
    of_log = rs.allan(rs.Log.read(folder / "rest.csv"), "gyro_rad_s", from_s=5.0, to_s=40.0)
    assert of_file.data == of_log.data


@pytest.fixture(scope="module")
def calibration_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibration")
    rs.calibrate_simulated(folder, seed=4, serial="G-1")
    return folder


def test_calibration_of_a_gyro(calibration_folder: Path) -> None:
    answer = rs.calibrate(calibration_folder)
    scale = answer.quantities["scale"]
    assert scale.sigma is not None and scale.value == pytest.approx(1.0, abs=0.05)
    assert len(answer.budget("scale")) > 1 and "scale" in list(answer.to_frame()["name"])
    assert "</html>" in answer.html
    with pytest.raises(rs.AnalysisError, match="gyro"):
        rs.calibrate(calibration_folder, kind="accel")
    with pytest.raises(ValueError, match="kind"):
        rs.calibrate(calibration_folder, kind="clock")


def test_calibration_needs_a_session(folder: Path) -> None:
    with pytest.raises(rs.RotaryStandError):
        rs.calibrate(folder)
    with pytest.raises(rs.RotaryStandError):
        rs.calibrate_simulated(folder, session="nonsense = ")


def test_changed_raw_log_is_refused(calibration_folder: Path, folder: Path) -> None:
    import shutil

    copy = folder / "copy"
    shutil.copytree(calibration_folder, copy)
    log = next(file for file in sorted(copy.iterdir()) if file.suffix in (".csv", ".parquet"))
    log.write_bytes(log.read_bytes()[:-1])
    with pytest.raises(rs.RotaryStandError, match=log.name):
        rs.calibrate(copy)


def test_bias_and_scale_of_a_gyro_on_the_platform(folder: Path) -> None:
    t = np.arange(60_000) * 1e-3
    rate = np.where((t // 5) % 2 == 0, 2.0, -2.0)
    angle = np.cumsum(rate) * 1e-3
    gyro = 1.01 * rate + 0.003 + np.random.default_rng(3).normal(0, 1e-4, t.size)
    answer = rs.drift_platform({"t_s": t, "theta_rad": angle, "omega_rad_s": rate, "gyro_rad_s": gyro})
    assert answer.quantities["scale"].value == pytest.approx(1.01, rel=1e-3)
    assert answer.cycles and "</html>" in answer.html


def test_drift_without_its_columns_is_an_error(cogging_log: rs.Log) -> None:
    with pytest.raises(rs.RotaryStandError, match="angle_gain"):
        rs.drift(cogging_log)


def test_observers(folder: Path) -> None:
    design = rs.observer_design("rate-observer")
    assert design.gains.shape == (4,) and design.poles == [-100.0] * 4 and len(design.to_frame()) == 4
    assert rs.observer_design("astatic-identifier", kind="integral").data["integral"]
    assert "</html>" in rs.observer_bode("rate-observer", omega_1_s=[50.0]).html
    for arguments in ({"kind": "other"}, {"kind": "static", "row": 2}, {"vibration_Hz": -1.0}):
        with pytest.raises(ValueError):
            rs.observer_design("rate-observer", **arguments)
    with pytest.raises(rs.AnalysisError):
        rs.observer_design("nothing")
    with pytest.raises(rs.AnalysisError):
        rs.observer_design("rate-observer", poles="-50,x")
    t = np.arange(4000) * 1e-3
    track = rs.observer_track({"t_s": t, "alpha_rad": 1e-4 * np.sin(t)})
    assert track.states and len(track.series) == 4000


def test_every_answer_has_a_table_and_those_with_curves_a_figure(cogging_log: rs.Log, nominal: rs.Model, calibration_folder: Path) -> None:
    noise = {"t_s": np.arange(5000) * 0.01, "gyro_rad_s": np.random.default_rng(2).normal(0, 1e-4, 5000)}
    answers: list[Any] = [
        cogging_log,
        rs.compare(cogging_log, nominal),
        rs.fit(cogging_log, nominal),
        rs.explain(cogging_log, nominal),
        rs.simulate(nominal, cogging_log),
        rs.allan(noise, "gyro_rad_s"),
        rs.calibrate(calibration_folder),
    ]
    for answer in answers:
        assert len(answer.to_frame()) > 0
        assert isinstance(answer.plot(), Figure)
    bode = rs.observer_bode("rate-observer", omega_1_s=[50.0])
    assert len(bode.curves) == 2 and len(bode.to_frame()) > 100 and isinstance(bode.plot(), Figure)
    design = rs.observer_design("rate-observer")
    assert len(design.to_frame()) > 0
    with pytest.raises(NotImplementedError):
        design.plot()


def test_simulated_log_is_equal_for_a_seed(folder: Path) -> None:
    first = rs.simulated_log(folder / "a.parquet", seconds=1, seed=7, profile="prbs", mode="voltage", parameters={"amplitude": 3})
    second = rs.simulated_log(folder / "b.parquet", seconds=1, seed=7, profile="prbs", mode="voltage", parameters={"amplitude": 3})
    assert all(np.array_equal(first[name], second[name]) for name in first)
    for arguments in ({"profile": "zigzag"}, {"mode": "torque"}, {"parameters": {"turns": 3}}, {"hidden": "coging"}, {"stand": "x = 1"}):
        with pytest.raises(ValueError):
            rs.simulated_log(folder / "c.parquet", **arguments)
    with pytest.raises((rs.RotaryStandError, ValueError)):
        rs.simulated_log(folder / "c.parquet", seconds=float("nan"))
    with pytest.raises(OverflowError):
        rs.simulated_log(folder / "c.parquet", seed=-1)
