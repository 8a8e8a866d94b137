#!/usr/bin/env python3
"""Regression check of the command `stand` against stored answers.

    scripts/goldens.py make    --stand BIN --out DIR [--only GLOB] [--jobs N]
    scripts/goldens.py compare --stand BIN --golden DIR [--only GLOB] [--jobs N]

`make` generates the input logs with BIN, runs a fixed set of commands on them and stores every JSON answer.
`compare` runs the same commands with another BIN on the stored logs and prints each difference.

A case has a name `GROUP/NAME`; GLOB selects by that name, for example 'quick/*' or '*fit*'.
Groups whose name starts with `firmware` run the simulated firmware, so their answers change when its arithmetic changes.
All other groups read stored logs only.

Rules of the comparison:
  keys       identical
  numbers    equal to 1e-9 relative or 1e-13 absolute
  strings    equal; free text (PROSE) and values of the run itself (VOLATILE) are ignored; a string of several words and no digits
             may have been reworded, the same way in every answer: the rewordings are listed at the end
  refusals   exit status equal; file names, columns and parameters listed with the case appear in the message

Cases from the public test logs need the folder that the environment variable STAND_DATA names. Without it they are skipped and counted.
Exit status of `compare`: 0 no difference, 1 differences.
"""

import argparse
import concurrent.futures
import fnmatch
import gzip
import hashlib
import json
import math
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

# Keys of display text.
PROSE = {"says", "message", "not_shown", "refused", "remarks", "warnings", "why", "what", "shows", "looks_like", "experiment", "equation",
         "reference", "statement", "left_out", "fault"}
# Keys of strings with digits: rewording is allowed, one old text to one new text.
WORDED = {"compared"}
# Keys that vary between identical runs.
VOLATILE = {"date", "began", "computed", "records", "tools", "sha256", "firmware", "version", "commit", "seconds", "elapsed_s"}

# Rewordings found: (key, old) -> new.
REWORDED = {}

RELATIVE = 1e-9
ABSOLUTE = 1e-13

EFFECTS = """coulomb viscous stribeck presliding asymmetric-friction quadratic-drag cogging unbalance torque-ripple load cable-spring
resistance-temperature viscous-temperature brush-drop inductance magnetic-saturation dead-time supply-droop compliance backlash load-step
encoder-eccentricity sensor-lag time-skew current-scale current-offset rate-scale rate-bias rate-bias-temperature rate-g-sensitivity
rate-scale-nonlinearity""".split()
PROFILES = ["multi-step", "multisine", "sweep"]
MODES = ["voltage", "rate"]
# The default stand's parameters; models are these with factors.
TRUTH = {
    "inertia_kg_m2": 2.5e-4,
    "motor_constant_N_m_A": 2.34e-2,
    "resistance_ohm": 2.32,
    "viscous_N_m_s": 2e-5,
    "coulomb_N_m": 9e-4,
    "inductance_H": 2.38e-4,
}
OWN_COUNT = 100
OWN_SECONDS = 12
QUICK_SECONDS = 6


class Case:
    """One command. `names` are words that its error message must contain; `log` is a log that the command writes, stored as column hashes."""

    def __init__(self, name, args, names=(), log=None, setup=None):
        self.name, self.args, self.names, self.log, self.setup = name, list(args), list(names), log, setup


def data_folder():
    root = os.environ.get("STAND_DATA", "STAND_DATA-is-not-set")
    return pathlib.Path(root).resolve()


def model_text(effects, factors, extra=""):
    lines = ["[drive]", 'input = "u_V"', f"effects = {json.dumps(effects)}", "[parameters]"]
    lines += [f"{name} = {value * factor:e}" for (name, value), factor in zip(TRUTH.items(), factors)]
    return "\n".join(lines) + "\n" + extra


def fixed_constant(model):
    """The model with current as input and fixed motor constant, as required by the equation-error fit."""
    model = re.sub(r"resistance_ohm.*\n", "", model.replace("u_V", "i_A"))
    return re.sub(r"motor_constant_N_m_A = (\S+)", r"motor_constant_N_m_A = { value = \1, fixed = true }", model)


def own_cases():
    """Simulated logs: each effect of the catalogue by name, then effects drawn by seed."""
    for k in range(OWN_COUNT):
        hidden = EFFECTS[k] if k < len(EFFECTS) else str(k)
        yield f"own{k:03}", hidden, PROFILES[k % 3], MODES[(k // 3) % 2], k + 1


# ---------------------------------------------------------------- inputs


def run(stand, args, cwd, timeout=900):
    environment = dict(os.environ, RAYON_NUM_THREADS="1", NO_COLOR="1", COLUMNS="80")
    return subprocess.run([stand, *args], cwd=cwd, env=environment, capture_output=True, text=True, timeout=timeout)


def make_inputs(stand, folder, pool):
    """Writes all logs and models below `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bad").mkdir(exist_ok=True)
    write_models(folder)
    write_synthetic(folder)
    commands = []
    for name, hidden, profile, mode, seed in own_cases():
        commands.append(["sim", "--out", f"{name}.parquet", "--hidden", hidden, "--profile", profile, "--mode", mode,
                         "--seconds", str(OWN_SECONDS), "--seed", str(seed)])
    for k, (hidden, profile, mode) in enumerate(QUICK_LOGS):
        commands.append(["sim", "--out", f"quick{k}.parquet", "--profile", profile, "--mode", mode, "--seconds", str(QUICK_SECONDS),
                         "--seed", str(k + 500)] + (["--hidden", hidden] if hidden else []))
    commands.append(["sim", "--out", "still.parquet", "--profile", "constant", "--amplitude", "0", "--seconds", "60"])
    commands.append(["calibrate", "gyro", "--session", "platform.toml", "--out", "platform"])
    for what in ("gyro", "accel", "drive"):
        for seed in (1, 2):
            commands.append(["calibrate", what, "--serial", f"S-{what}", "--seed", str(seed), "--out", f"calibrated-{what}-{seed}"])
    for name, words in DRIFT_LOGS.items():
        commands.append(["drift", "run", *words, "--out", name])
    for name, text in GYROS.items():
        (folder / name).write_text(text)

    def one(args):
        ran = run(stand, args, folder)
        return "" if ran.returncode == 0 else f"{' '.join(args)}: exit {ran.returncode}: {ran.stderr.strip()}"

    problems = [p for p in pool.map(one, commands) if p]
    for problem in problems:
        print("input not made:", problem)
    write_bad_logs(folder)


QUICK_LOGS = [(None, "multi-step", "voltage"), ("cogging", "multi-step", "voltage"), ("stribeck", "multi-step", "rate"),
              ("load", "multisine", "rate"), ("time-skew", "multi-step", "rate"), ("current-scale", "sweep", "voltage"),
              ("backlash", "multi-step", "rate"), ("compliance", "multi-step", "voltage"), ("presliding", "multi-step", "rate"),
              ("encoder-eccentricity", "multi-step", "rate"), ("brush-drop", "multi-step", "voltage"), ("unbalance", "sweep", "rate"),
              ("sensor-lag", "multi-step", "voltage"), ("magnetic-saturation", "multi-step", "rate")]
GYROS = {
    "unequal.toml": "[torquer]\ngain_inequality = 3e-3\n",
    "gravity.toml": "[own]\nconstant_rad_s = 7.27e-6\noutput_rad_s_g = 4.848e-6\nspin_rad_s_g = -2.424e-6\n",
}
DRIFT_LOGS = {
    "drift-plain.csv": ["--cycles", "4"],
    "drift-two-rates.csv": ["--cycles", "3", "--gyro", "unequal.toml", "--rate", "0.05,0.02"],
    "drift-four-turns.csv": ["--cycles", "2", "--gyro", "gravity.toml", "--positions", "0,90,180,270"],
    "drift-triangular.csv": ["--cycles", "2", "--shape", "triangular", "--sequence", "plus-minus", "--pulse", "2", "--seed", "5"],
    "drift-rolls.csv": ["--cycles", "2", "--gyro", "gravity.toml", "--positions", "0,180,0:0:90,0:0:180,0:0:270", "--pulse", "2"],
}


def write_models(folder):
    base = ["viscous", "coulomb", "inductance"]
    draw = random.Random(20)
    (folder / "nominal.toml").write_text(model_text(base, [1.0] * 6))
    for k in range(10):
        (folder / f"model{k}.toml").write_text(model_text(base, [1.0 + draw.uniform(-0.2, 0.2) for _ in TRUTH]))
    (folder / "cogging.toml").write_text(model_text(
        base + ["cogging"], [1.1, 0.9, 1.05, 1, 1, 1], "cogging_N_m = 1e-3\ncogging_order = 12\ncogging_phase_rad = 0.1\n"))
    (folder / "torque.toml").write_text(fixed_constant(model_text(base[:2], [1.1, 1, 1.05, 1, 1])))
    (folder / "torque-cogging.toml").write_text(fixed_constant(model_text(
        base[:2] + ["cogging"], [1.1, 1, 1.05, 1, 1],
        "cogging_N_m = 1e-3\ncogging_order = { value = 12, fixed = true }\ncogging_phase_rad = 0.1\n")))
    (folder / "platform.toml").write_text(
        'what = "gyro"\nsensor = "x"\nserial = "P-1"\nsettle_s = 0.5\n[known]\ncrystal_ppm = 50.0\n'
        '[[steps]]\nname = "back and forth"\nmode = "rate"\nprofile = "alternating"\namplitude = 2.0\ndwell_s = 5.0\nseconds = 65.0\n')
    bad = folder / "bad"
    (bad / "unknown-effect.toml").write_text(model_text(base + ["friktion"], [1.0] * 6))
    (bad / "missing-parameter.toml").write_text(model_text(base, [1.0] * 6).replace("resistance_ohm", "resistance_Ohm"))
    (bad / "negative.toml").write_text(model_text(base, [-1.0] + [1.0] * 5))
    (bad / "not.toml").write_text("[drive\n")


def write_synthetic(folder):
    """Logs that no command generates: noise with bias instability, and a vibrating gyrotheodolite."""
    draw = random.Random(7)
    rows, walk = ["t_s,gyro_rad_s,theta_rad"], 0.0
    angle = 0.0
    for k in range(60000):
        walk += draw.gauss(0.0, 2e-7)
        rate = walk + draw.gauss(0.0, 1e-3) + 0.01
        angle += rate * 0.01
        rows.append(f"{k * 0.01:.2f},{rate:.9e},{angle:.9e}")
    (folder / "noise.csv").write_text("\n".join(rows) + "\n")
    rows = ["# angle_gain_V_rad: 20", "t_s,angle_sensor_V,gamma_rad,alpha_rate_rad_s,beta_rate_rad_s"]
    for k in range(20000):
        t, w = k * 1e-3, 4 * math.pi
        rows.append(f"{t:.3f},{20 * (1e-4 + 2e-5 * math.sin(w * t)):.9e},{1e-5 * math.cos(w * t):.9e},"
                    f"{2e-5 * w * math.cos(w * t):.9e},{1e-5 * w * math.sin(w * t + 0.3):.9e}")
    (folder / "vibration.csv").write_text("\n".join(rows) + "\n")
    rows = ["t_s,angle_sensor_V"]
    for k in range(12000):
        t = k * 0.005
        rows.append(f"{t:.3f},{20 * (1e-6 * math.sin(2 * math.pi * 0.7 * t) + draw.gauss(0, 3e-7)):.9e}")
    (folder / "quiet.csv").write_text("\n".join(rows) + "\n")


def write_bad_logs(folder):
    """Logs with one fault each."""
    bad = folder / "bad"
    draw = random.Random(3)
    rows, rate, current = [], 0.0, 0.0
    levels = [0, 3, -2, 5, -4, 2, 6, -6, 1, -3]
    for k in range(8000):
        volts = levels[(k // 400) % len(levels)]
        current = (volts - 0.0234 * rate) / 2.32
        for _ in range(1):
            rate += 1e-3 * (0.0234 * current - 2e-5 * rate - math.copysign(9e-4, rate if rate else volts)) / 2.5e-4
        rows.append([k * 1e-3, volts, rate + draw.gauss(0, 0.01), current + draw.gauss(0, 2e-3)])
    header = ["t_s", "u_V", "omega_rad_s", "i_A"]

    def put(name, change=None, head=header):
        table = [list(r) for r in rows]
        if change:
            for k, r in enumerate(table):
                change(k, r)
        lines = [",".join(head)] + [",".join(x if isinstance(x, str) else f"{x:.9g}" for x in r) for r in table]
        (bad / name).write_text("\n".join(lines) + "\n")

    def at(row, column, value):
        def change(k, r):
            if k == row:
                r[column] = value
        return change

    def scale(column, factor):
        def change(_, r):
            r[column] *= factor
        return change

    def swap(_, r):
        r[2], r[3] = r[3], r[2]

    def whole(_, r):
        r[2] = round(r[2])

    def constant(column, value):
        def change(_, r):
            r[column] = value
        return change

    put("good.csv")
    put("nan.csv", at(70, 2, "nan"))
    put("text.csv", at(71, 3, "abc"))
    put("back.csv", at(90, 0, 0.01))
    put("rpm.csv", scale(2, 9.549296585513721))
    put("degrees.csv", scale(2, 57.29577951308232))
    put("minus.csv", scale(2, -1.0))
    put("milliamperes.csv", scale(3, 1000.0))
    put("swapped.csv", swap)
    put("whole.csv", whole)
    put("stuck-current.csv", constant(3, 0.25))
    put("stuck-voltage.csv", constant(1, 2.0))
    put("still.csv", constant(2, 0.0))
    put("no-rate.csv", head=["t_s", "u_V", "speed", "i_A"])
    put("twice.csv", head=["t_s", "u_V", "i_A", "i_A"])
    put("no-time.csv", head=["time", "u_V", "omega_rad_s", "i_A"])
    (bad / "empty.csv").write_text("")
    (bad / "header.csv").write_text(",".join(header) + "\n")
    (bad / "short-row.csv").write_text("t_s,u_V,omega_rad_s\n0,1,2\n0.001,1\n0.002,1,2\n")
    (bad / "random.parquet").write_bytes(bytes(random.Random(1).randrange(256) for _ in range(500)))
    (bad / "session.toml").write_text('what = "gyro"\nsensor = "x"\nserial = "1"\nsettle_s = 0.5\n[known]\ncrystal_ppm = 50.0\n'
                                      '[[steps]]\nname = "fast"\nmode = "rate"\nprofile = "staircase"\namplitude = 50.0\nseconds = 10.0\n')
    (bad / "stand.toml").write_text("[effects.cogging]\ncogging_Nm = 1e-3\n")


# ---------------------------------------------------------------- cases


def cases(folder):
    """All cases. `folder` contains the inputs."""
    found = []

    def add(name, *args, names=(), log=None, json_out=True, setup=None):
        found.append(Case(name, list(args) + (["--json", "-"] if json_out else []), names, log, setup))

    for k, (hidden, _, _) in enumerate(QUICK_LOGS):
        label = hidden or "none"
        log = f"in/quick{k}.parquet"
        add(f"quick/compare-{label}", "compare", log, "--model", "in/model1.toml")
        add(f"quick/fit-{label}", "fit", log, "--model", "in/model1.toml")
        if k not in (3, 5):
            add(f"quick/explain-{label}", "explain", log, "--model", "in/model2.toml")
    add("quick/calibrate-gyro", "calibrate", "gyro", "--from", "in/calibrated-gyro-1")
    add("quick/drift", "drift", "compute", "in/drift-plain.csv")
    add("quick/allan", "allan", "in/still.parquet", "--column", "omega_rad_s")
    add("quick/observer", "observer", "design", "astatic-identifier-recovered")
    add("quick/effects", "effects")
    add("quick/effect-cogging", "effects", "cogging")

    for kind in ("compare", "fit"):
        for k, (name, hidden, _, _, _) in enumerate(own_cases()):
            add(f"{kind}/{name}-{hidden}", kind, f"in/{name}.parquet", "--model", f"in/model{k % 10}.toml")
    add("fit/all-rows", "fit", "in/own006.parquet", "--model", "in/model3.toml", "--all-rows")
    add("fit/equation-error", "fit", "in/own006.parquet", "--model", "in/torque.toml", "--equation-error")
    add("fit/equation-error-inductance", "fit", "in/own006.parquet", "--model", "in/model3.toml", "--equation-error",
        names=["own006.parquet", "inductance"])
    add("fit/with-cogging", "fit", "in/own006.parquet", "--model", "in/cogging.toml")
    add("fit/equation-error-cogging", "fit", "in/own006.parquet", "--model", "in/torque-cogging.toml", "--equation-error", "--cutoff-hz", "50")
    for k, (name, hidden, _, _, _) in enumerate(own_cases()):
        add(f"explain/{name}-{hidden}", "explain", f"in/{name}.parquet", "--model", f"in/model{k % 10}.toml")
    add("explain/two-logs", "explain", "in/own006.parquet", "in/own007.parquet", "--model", "in/model3.toml")
    data = data_folder() / "cases"
    if data.is_dir():
        for path in sorted(p.name for p in data.iterdir() if p.is_dir()):
            add(f"foreign/{path}", "explain", f"foreign/{path}/log.parquet", "--model", f"foreign/{path}/model.toml")
            add(f"foreign-compare/{path}", "compare", f"foreign/{path}/log.parquet", "--model", f"foreign/{path}/model.toml")

    for what in ("gyro", "accel", "drive"):
        for seed in (1, 2):
            add(f"calibrate/{what}-{seed}", "calibrate", what, "--from", f"in/calibrated-{what}-{seed}")
    add("calibrate/list", "records", "list", "in")
    add("calibrate/show", "records", "show", "in/calibrated-gyro-1")
    add("calibrate/trend", "records", "trend", "in", "--serial", "S-gyro")
    add("calibrate/wrong-kind", "calibrate", "drive", "--from", "in/calibrated-gyro-1", names=["calibrated-gyro-1"])

    for name in DRIFT_LOGS:
        extra = ["--turn-error", "1", "--level-error", "5"] if "plain" in name else []
        add(f"drift/{name[6:-4]}", "drift", "compute", f"in/{name}", *extra)
    add("drift/advise", "drift", "advise", "in/quiet.csv", "--angle-gain", "20")
    add("drift/advise-3s", "drift", "advise", "in/quiet.csv", "--angle-gain", "20", "--pulse", "3")
    add("drift/platform", "drift", "platform", "in/platform/01-back-and-forth.parquet", "--pulse", "5")
    add("drift/no-gain", "drift", "advise", "in/quiet.csv", names=["quiet.csv", "angle_gain_V_rad", "--angle-gain"])
    add("drift/no-column", "drift", "compute", "in/bad/good.csv", "--angle-gain", "20", "--torquer-gain", "1", "--pulse", "5",
        names=["good.csv", "angle_sensor_V"])

    presets = ["astatic-identifier", "astatic-identifier-recovered", "rate-observer"]
    for preset in presets:
        for kind in ("static", "integral", "augmented"):
            add(f"observer/design-{preset}-{kind}", "observer", "design", preset, "--kind", kind)
        add(f"observer/bode-{preset}", "observer", "bode", preset)
        add(f"observer/simulate-{preset}", "observer", "simulate", preset)
    add("observer/bode-many", "observer", "bode", "rate-observer", "--omega", "10,100,1000", "--vibration-hz", "2")
    add("observer/design-poles", "observer", "design", "rate-observer", "--poles", "-100,-120,-80+60i,-80-60i")
    add("observer/design-60", "observer", "design", "astatic-identifier-recovered", "--omega", "60", "--vibration-hz", "2")
    add("observer/simulate-augmented", "observer", "simulate", "astatic-identifier-recovered", "--kind", "augmented")
    add("observer/vibration", "vibration", "compensate", "in/vibration.csv")
    add("observer/unstable", "observer", "design", "astatic-identifier-recovered", "--integral-gain", "8e6", "--step", "1e-3", names=["0.001"])
    add("observer/unknown", "observer", "design", "rate-observr", names=["rate-observr", "rate-observer"])

    for column in ("omega_rad_s", "i_A", "theta_rad"):
        add(f"allan/still-{column}", "allan", "in/still.parquet", "--column", column, names=["still.parquet", column])
    for taus in ("octave", "decade", "fine"):
        add(f"allan/noise-{taus}", "allan", "in/noise.csv", "--column", "gyro_rad_s", "--taus", taus)
    add("allan/noise-angle", "allan", "in/noise.csv", "--column", "theta_rad")
    add("allan/noise-part", "allan", "in/noise.csv", "--column", "gyro_rad_s", "--from", "60", "--to", "360")
    add("allan/no-column", "allan", "in/noise.csv", "--column", "gyro_rads", names=["noise.csv", "gyro_rads"])

    add("effects/all", "effects")
    for effect in EFFECTS:
        add(f"effects/{effect}", "effects", effect)
    add("effects/unknown", "effects", "cogs", names=["cogs"])

    for name, words in REFUSED.items():
        add(f"bad/{name}", "compare", f"in/bad/{name}", "--model", "in/nominal.toml", names=words)
    for name in PLAUSIBLE:
        for kind in ("compare", "fit", "explain"):
            add(f"bad/{name}-{kind}", kind, f"in/bad/{name}", "--model", "in/nominal.toml", names=[name])
    add("bad/model-unknown-effect", "fit", "in/bad/good.csv", "--model", "in/bad/unknown-effect.toml", names=["unknown-effect.toml", "friktion"])
    add("bad/model-missing-parameter", "fit", "in/bad/good.csv", "--model", "in/bad/missing-parameter.toml",
        names=["missing-parameter.toml", "resistance_ohm"])
    add("bad/model-negative", "fit", "in/bad/good.csv", "--model", "in/bad/negative.toml", names=["negative.toml", "inertia_kg_m2"])
    add("bad/model-not-toml", "fit", "in/bad/good.csv", "--model", "in/bad/not.toml", names=["not.toml"])
    add("bad/no-log", "fit", "in/nothing.csv", "--model", "in/nominal.toml", names=["nothing.csv"])
    add("bad/no-model", "fit", "in/bad/good.csv", "--model", "in/nothing.toml", names=["nothing.toml"])
    add("bad/word", "fit", "in/bad/good.csv", "--modell", "in/nominal.toml", names=["--modell"])

    # Simulated firmware: results change with its arithmetic.
    for profile in ["multi-step", "multisine", "prbs", "sweep", "staircase", "trapezoid", "s-curve", "sine", "turns", "alternating", "abba"]:
        for mode in ("rate",) if profile == "turns" else MODES:
            add(f"firmware-log/{profile}-{mode}", "sim", "--out", "log.csv", "--profile", profile, "--mode", mode, "--seconds", "8",
                "--seed", "3", log="log.csv")
    for k, effect in enumerate(EFFECTS):
        add(f"firmware-log/hidden-{effect}", "sim", "--out", "log.csv", "--hidden", effect, "--mode", MODES[k % 2], "--seconds", "6",
            "--seed", str(k), "--reveal", log="log.csv")
    for seed in range(5):
        add(f"firmware-log/seed-{seed}", "sim", "--out", "log.csv", "--hidden", str(seed), "--seconds", "6", "--seed", str(seed),
            "--reveal", log="log.csv")
    add("firmware-run/drift", "drift", "run", "--cycles", "2", "--pulse", "2", "--out", "log.csv", log="log.csv")
    add("firmware-run/drift-drive", "drift", "run", "--cycles", "2", "--pulse", "2", "--turn", "drive", "--out", "log.csv", log="log.csv")
    add("firmware-run/compensate-measured", "compensate", "--measure-cogging", "--stand", "my-stand.toml")
    add("firmware-run/compensate-model", "compensate", "--model", "in/cogging.toml", "--log", "in/own006.parquet", "--stand", "my-stand.toml")
    add("firmware-run/calibrate-gyro", "calibrate", "gyro", "--out", "g", "--seed", "3")
    add("firmware-run/calibrate-limits", "calibrate", "gyro", "--session", "in/bad/session.toml", "--out", "g", names=["fast", "50"])
    add("firmware-run/bad-stand", "sim", "--out", "log.csv", "--stand", "in/bad/stand.toml", names=["cogging_Nm", "stand.toml"])
    add("firmware-run/bad-hidden", "sim", "--out", "log.csv", "--hidden", "coging", names=["coging", "cogging"])
    return found


# Unreadable logs, with words that the error message must contain.
REFUSED = {
    "nan.csv": ["nan.csv", "71", "omega_rad_s"],
    "text.csv": ["text.csv", "72", "i_A"],
    "back.csv": ["back.csv", "91", "t_s"],
    "no-rate.csv": ["no-rate.csv"],
    "twice.csv": ["twice.csv", "i_A"],
    "no-time.csv": ["no-time.csv", "t_s"],
    "empty.csv": ["empty.csv"],
    "header.csv": ["header.csv"],
    "short-row.csv": ["short-row.csv"],
    "random.parquet": ["random.parquet"],
}
# Readable but implausible logs.
PLAUSIBLE = ["good.csv", "rpm.csv", "degrees.csv", "minus.csv", "milliamperes.csv", "swapped.csv", "whole.csv", "stuck-current.csv",
             "stuck-voltage.csv", "still.csv"]


def answer_of(stand, case, inputs):
    """Runs a case in its own folder: {exit, json | refused, log}."""
    with tempfile.TemporaryDirectory(prefix="golden-") as scratch:
        scratch = pathlib.Path(scratch)
        (scratch / "in").symlink_to(inputs)
        data = data_folder() / "cases"
        if data.is_dir():
            (scratch / "foreign").symlink_to(data)
        begun = time.monotonic()
        ran = run(stand, case.args, scratch)
        answer = {"exit": ran.returncode}
        if ran.returncode == 0:
            answer["json"] = json.loads(ran.stdout) if ran.stdout.strip() else None
        else:
            answer["refused"] = {"lines": len(ran.stderr.strip().splitlines()), "named": {n: n in ran.stderr for n in case.names},
                                 "message": ran.stderr.strip()}
        if case.log and ran.returncode == 0:
            answer["log"] = columns_of(scratch / case.log)
        return answer, time.monotonic() - begun


def columns_of(path):
    """Each column of a CSV log: hash of its text, mean and root mean square."""
    notes, header, columns = {}, None, []
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            key, _, value = line[1:].partition(":")
            if key.strip() not in VOLATILE:
                notes[key.strip()] = value.strip()
        elif header is None:
            header = line.split(",")
            columns = [[] for _ in header]
        else:
            for column, cell in zip(columns, line.split(",")):
                column.append(cell)
    result = {}
    for name, cells in zip(header or [], columns):
        values = [float(c) for c in cells if c]
        count = max(len(values), 1)
        result[name] = {"rows": len(cells), "hash": hashlib.sha256("\n".join(cells).encode()).hexdigest()[:16],
                        "mean": sum(values) / count, "rms": math.sqrt(sum(v * v for v in values) / count)}
    return {"columns": result, "notes": notes}


# ---------------------------------------------------------------- comparison


def differences(old, new, path="", key=""):
    """Yields (path, old, new) for each difference."""
    if key in VOLATILE:
        return
    if isinstance(old, dict) and isinstance(new, dict):
        for name in list(old) + [n for n in new if n not in old]:
            where = f"{path}.{name}" if path else name
            if name not in new:
                yield where, "present", "MISSING KEY"
            elif name not in old:
                yield where, "absent", "NEW KEY"
            else:
                yield from differences(old[name], new[name], where, name)
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield path, f"{len(old)} items", f"{len(new)} items"
        for k, (a, b) in enumerate(zip(old, new)):
            yield from differences(a, b, f"{path}[{k}]", key)
    elif isinstance(old, bool) or isinstance(new, bool) or old is None or new is None:
        # A new error message may be longer than the old one.
        if old is not new and not (".named." in path and new is True):
            yield path, old, new
    elif isinstance(old, (int, float)) and isinstance(new, (int, float)):
        if old != new and not math.isclose(old, new, rel_tol=RELATIVE, abs_tol=ABSOLUTE):
            yield path, old, new
    elif isinstance(old, str) and isinstance(new, str):
        if old == new:
            REWORDED.setdefault((key, old), new)
            return
        if key in ("says", "message") or (key in PROSE and " " in old):
            return
        if " " in old and (key in WORDED or not any(c.isdigit() for c in old)):
            if REWORDED.setdefault((key, old), new) == new:
                return
        yield path, old, new
    else:
        yield path, old, new


def run_all(stand, chosen, inputs, jobs, done):
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(answer_of, stand, case, inputs): case for case in chosen}
        for future in concurrent.futures.as_completed(futures):
            case = futures[future]
            try:
                answer, seconds = future.result()
            except (json.JSONDecodeError, subprocess.TimeoutExpired, OSError) as problem:
                answer, seconds = {"failed": str(problem)}, 0.0
            done(case, answer, seconds)


def selected(folder, only):
    return [c for c in cases(folder) if any(fnmatch.fnmatch(c.name, g) for g in (only or ["*"]))]


def answers_file(folder, group):
    return folder / f"{group}.json.gz"


def make(options):
    folder = pathlib.Path(options.out).resolve()
    inputs = folder / "inputs"
    stand = str(pathlib.Path(options.stand).resolve())
    if not options.keep_inputs:
        shutil.rmtree(inputs, ignore_errors=True)
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            make_inputs(stand, inputs, pool)
        print(f"inputs made in {inputs}")
    groups, times = {}, {}

    def done(case, answer, seconds):
        group, name = case.name.split("/", 1)
        groups.setdefault(group, {})[name] = answer
        times[group] = times.get(group, 0.0) + seconds
        if "failed" in answer:
            print("no answer:", case.name, answer["failed"])

    run_all(stand, selected(folder, options.only), inputs, options.jobs, done)
    for group, answers in groups.items():
        if options.keep_inputs and answers_file(folder, group).exists():
            answers = json.loads(gzip.decompress(answers_file(folder, group).read_bytes())) | answers
        text = json.dumps(answers, sort_keys=True, separators=(",", ":"), ensure_ascii=False).encode()
        answers_file(folder, group).write_bytes(gzip.compress(text, 9, mtime=0))
        print(f"{group:16} {len(answers):4} answers {times[group]:7.1f} s {len(text):10} bytes")


def compare(options):
    folder = pathlib.Path(options.golden).resolve()
    inputs = folder / "inputs"
    stand = str(pathlib.Path(options.stand).resolve())
    stored = {}
    for path in folder.glob("*.json.gz"):
        stored[path.name[:-8]] = json.loads(gzip.decompress(path.read_bytes()))
    chosen = []
    for case in selected(folder, options.only):
        group, name = case.name.split("/", 1)
        if name in stored.get(group, {}):
            chosen.append(case)
    skipped = sum(len(answers) for answers in stored.values()) - len(chosen) if not options.only else 0
    bad = {"analysis": [], "firmware": []}

    def done(case, answer, _):
        group, name = case.name.split("/", 1)
        found = list(differences(stored[group][name], answer))
        if not found:
            return
        bad["firmware" if group.startswith("firmware") else "analysis"].append(case.name)
        print(f"\n{case.name}: {len(found)} differences   (stand {' '.join(case.args)})")
        for where, old, new in found[: options.lines]:
            print(f"  {where}: {shown(old)} -> {shown(new)}")
        if len(found) > options.lines:
            print(f"  … and {len(found) - options.lines} more")

    begun = time.monotonic()
    REWORDED.clear()
    run_all(stand, chosen, inputs, options.jobs, done)
    for (key, old), new in sorted(REWORDED.items()):
        if old != new:
            print(f"reworded {key}: {old!r} -> {new!r}")
    print(f"\n{len(chosen)} cases in {time.monotonic() - begun:.0f} s; with differences: "
          f"{len(bad['analysis'])} of the analysis, {len(bad['firmware'])} of the simulated firmware"
          + (f"; {skipped} skipped, their data are missing" if skipped else ""))
    return 1 if bad["analysis"] or bad["firmware"] else 0


def shown(value):
    text = repr(value)
    return text if len(text) < 160 else text[:157] + "…"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, place in (("make", "--out"), ("compare", "--golden")):
        command = commands.add_parser(name)
        command.add_argument("--stand", required=True, help="the binary")
        command.add_argument(place, required=True, help="the folder of the goldens")
        command.add_argument("--only", action="append", help="names of cases, as a pattern; repeatable")
        command.add_argument("--jobs", type=int, default=2)
        if name == "make":
            command.add_argument("--keep-inputs", action="store_true", help="use the existing logs and keep the answers of other cases")
        else:
            command.add_argument("--lines", type=int, default=8, help="differences shown per case")
    options = parser.parse_args()
    sys.exit(make(options) if options.command == "make" else compare(options))


if __name__ == "__main__":
    main()
