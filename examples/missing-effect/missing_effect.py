"""The package finds an effect that a model lacks: simulate, fit, explain, add the effect, fit again.

python examples/missing-effect/missing_effect.py prints the residual over the noise of both fits, and the effect. Needs rotary_stand.
"""

import tempfile
from pathlib import Path

import rotary_stand as rs

# The drive by its data sheets; the stand also has cogging.
PARAMETERS = {
    "inertia_kg_m2": 2.2e-4,
    "motor_constant_N_m_A": 0.0234,
    "resistance_ohm": 2.32,
    "viscous_N_m_s": 1e-5,
    "coulomb_N_m": 8.6e-4,
    "inductance_H": 2.38e-4,
}


def simulated() -> rs.Log:
    """A log of the simulated stand. One of your own: rs.Log.read("run.csv"), or a DataFrame with t_s, u_V, omega_rad_s."""
    with tempfile.TemporaryDirectory() as folder:
        return rs.simulated_log(Path(folder) / "run.parquet", hidden="cogging", seed=1)


def ratio(fit: rs.Fit) -> float:
    """The residual over the noise in the worst channel, 1 where only noise is left."""
    return max(output.ratio for output in fit.outputs.values())


def main() -> None:
    log = simulated()
    model = rs.Model(["viscous", "coulomb", "inductance"], parameters=PARAMETERS)

    fit = rs.fit(log, model)
    print(f"without the effect: {ratio(fit):.1f} × noise")

    explanation = rs.explain(log, fit.model)
    print("missing:", ", ".join(explanation.missing))

    # The search also gives start values: an effect with a harmonic order needs them. Others are added by model.add(effect) as well.
    fit = rs.fit(log, explanation.model)
    print(f"with the effect: {ratio(fit):.2f} × noise")
    print(f"cogging: {1e3 * fit.model.cogging_N_m:.3f} mN m, {fit.model.cogging_order:.0f} periods per turn")


if __name__ == "__main__":
    main()
