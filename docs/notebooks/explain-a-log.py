# %% [markdown]
# # Explain a log
#
# A model of a drive is compared with a measurement. The model fails; `explain` names the physical effect that it lacks. The measurement comes from the simulated
# stand, to which a seed adds an effect that this notebook does not know.

# %%
import matplotlib.pyplot as plt

import rotary_stand as rs

log = rs.simulated_log("run.parquet", seconds=15, seed=1, hidden=3)
log

# %% [markdown]
# The log could be a DataFrame as well: `rs.Log.from_pandas(frame)`, or the frame itself in every function below.

# %%
log.to_pandas()[["t_s", "u_V", "i_A", "omega_rad_s", "theta_rad"]].describe().round(4)

# %% [markdown]
# The model: effects of the catalogue, and the data sheet's values of the motor.

# %%
model = rs.Model(
    ["viscous", "coulomb", "inductance"],
    parameters={
        "inertia_kg_m2": 2.2e-4,
        "motor_constant_N_m_A": 0.0234,
        "resistance_ohm": 2.32,
        "viscous_N_m_s": 1e-5,
        "coulomb_N_m": 8.6e-4,
        "inductance_H": 2.38e-4,
    },
)
fit = rs.fit(log, model)
print(fit)

# %% [markdown]
# The best fit of this model leaves much more than noise. The residual below the curves shows where.

# %%
fit.plot()
plt.show()

# %% [markdown]
# What is missing?

# %%
answer = rs.explain(log, model)
print(answer)

# %%
answer.to_frame().head(6)

# %% [markdown]
# `answer.model` has the missing effect with fitted values. Only noise is left.

# %%
better = rs.fit(log, answer.model)
print(better.outputs["omega_rad_s"].ratio)
better.to_frame()[["name", "value", "sigma", "unit"]]

# %%
better.plot()
plt.show()

# %% [markdown]
# A sensitivity is the exact derivative of a modelled output by a parameter, row by row: where the log tells about it.

# %%
simulation = rs.simulate(better.model, log)
figure, axis = plt.subplots(figsize=(8, 2.5), layout="constrained")
for parameter in ("inertia_kg_m2", "coulomb_N_m"):
    scaled = simulation.sensitivity("omega_rad_s", parameter) * better.model[parameter]
    axis.plot(simulation.series["t_s"], scaled, linewidth=0.8, label=parameter)
axis.set_xlabel("t_s")
axis.set_ylabel("p · ∂ω/∂p, rad/s")
axis.legend()
plt.show()
