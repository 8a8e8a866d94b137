#!/usr/bin/env bash
# Writes the files of this folder, and the answers about them, with the command of an earlier commit.
# Usage: make.sh STAND FOLDER; STAND is the command of that commit, FOLDER is empty. Takes half a minute: three recordings are in real time.
set -euo pipefail
stand="$(realpath "$1")"
cd "$2"
answers() { mkdir -p answers && "$stand" "$@" --json - >"answers/$answer.json"; }

# A stand, served, with an effect that the model lacks; its settings.
cat >stand.toml <<'TOML'
[effects.coulomb]
[effects.cogging]
cogging_N_m = 1.5e-3
cogging_order = 7
cogging_phase_rad = 1.0
[imu]
radius_m = 0.05
gyro_bias_rad_s = 0.004
TOML
"$stand" sim --serve pty --link port --stand stand.toml >served.txt &
served=$!
trap 'kill $served 2>/dev/null || true' EXIT
until [ -e port ]; do sleep 0.1; done
"$stand" settings export --port port --file settings.toml >/dev/null

# Two logs of the same length with other row rates; and what remains of a killed recording.
"$stand" record --port port --out run.parquet --decimation 5 --seconds 4 --note operator=Ann >/dev/null
"$stand" record --port port --out run.csv --decimation 20 --seconds 3 --seed 2 >/dev/null
"$stand" record --port port --out killed.csv --decimation 20 --seconds 30 --seed 3 >/dev/null &
sleep 2.9
kill -KILL $!
wait $! 2>/dev/null || true
kill -INT $served
wait $served || true
rm -f served.txt port

# Models: by hand with an effect of the user's own, and as a fit writes them.
cat >model.toml <<'TOML'
# my stand
[drive]
input = "u_V"
effects = ["viscous", "coulomb", "inductance"]

[parameters]
inertia_kg_m2 = 2.2e-4
motor_constant_N_m_A = { value = 0.0234, fixed = true }
resistance_ohm = 2.32
viscous_N_m_s = 1e-5 # a guess
coulomb_N_m = 8.6e-4
inductance_H = { value = 2.38e-4, fixed = true }

[effect.hump]
torque_N_m = "a * sin(7 * theta + p)"
parameters = { a = 1e-3, p = 1.0 }
TOML
sed '/^\[effect/,$d' model.toml >plain.toml
answer=fit-parquet answers fit run.parquet --model model.toml --out fitted.toml
answer=fit-csv answers fit run.csv --model model.toml
answer=fit-fitted answers fit run.parquet --model fitted.toml
answer=compare-killed answers compare killed.part.csv --model fitted.toml
mkdir logs
cp run.parquet logs
"$stand" explain logs --model plain.toml --table table.parquet >/dev/null
answer=fleet answers fleet report table.parquet
rm -r logs table.parquet.journal 2>/dev/null || true

# A log of another program, accepted.
awk -F, 'BEGIN { print "time [ms];speed [rpm];current [mA];voltage [V]" } !/^#/ && NR > 1 && $1 != "t_s" && n++ < 120 { printf "%.3f;%.4f;%.3f;%s\n", 1e3*$1, $6*9.549296586, 1e3*$4, $2 }' run.csv >foreign.csv
"$stand" log inspect foreign.csv --accept >/dev/null
answer=inspect answers log inspect foreign.csv
answer=compare-foreign answers compare foreign.csv --model plain.toml

# A calibration session that was killed in its second step; the record of what it has, in its folder and in a store.
cat >session.toml <<'TOML'
what = "gyro"
settle_s = 0.1
serial = "S-1"
[[steps]]
name = "one"
mode = "rate"
profile = "staircase"
amplitude = 4.0
levels = 1
dwell_s = 0.5
seconds = 2.5
[[steps]]
name = "two"
mode = "rate"
profile = "staircase"
amplitude = 2.0
levels = 1
dwell_s = 0.5
seconds = 60.0
TOML
"$stand" calibrate gyro --session session.toml --stand stand.toml --seed 5 --out session >/dev/null &
until [ -s session/02-two.parquet.csv ]; do sleep 0.01; done
kill -KILL $!
wait $! 2>/dev/null || true
rm session.toml
truncate --size=8001 session/02-two.parquet.csv # the rows at its end are many and of no interest
"$stand" calibrate gyro --from session --json session/record.json >/dev/null
"$stand" records add store session >/dev/null
answer=list answers records list store
answer=evaluate answers records evaluate store --session 1 --rate -3,0,3
rm -r store/logs # the log of the session once more
