# %% [markdown]
# # From your own bench's CSV to a model
#
# A file of another program has its own names, units and separators. This notebook writes such a file from a simulated drive whose friction rises at low rates, as a data
# logger in a German laboratory would, and reads it.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotary_stand as rs

measured = rs.simulated_log("bench.parquet", seconds=12, seed=9, hidden="stribeck").to_pandas()
pd.DataFrame(
    {
        "Zeit [ms]": 1e3 * measured["t_s"],
        "PWM": measured["u_V"] / 12,
        "Strom [mA]": 1e3 * measured["i_A"],
        "Drehzahl [rpm]": measured["omega_rad_s"] * 60 / (2 * np.pi),
    }
).to_csv("bench.csv", sep=";", decimal=",", index=False, float_format="%.9g")
print(*open("bench.csv").readlines()[:4], sep="")

# %% [markdown]
# `inspect` says what the columns are believed to be, and asks for what it cannot know. Nothing is assumed silently.

# %%
found = rs.inspect("bench.csv")
print(found)

# %% [markdown]
# The duty of the bridge is a fraction of 12 V; that is stated. The other units are in the header.

# %%
log = rs.Log.read("bench.csv", columns={"PWM": "u_V"}, units={"PWM": "12 V"})
log

# %%
figure = log.plot()
plt.show()

# %% [markdown]
# A model with start values of the data sheet, and its fit.

# %%
model = rs.Model(
    ["viscous", "coulomb", "inductance"],
    parameters={"inertia_kg_m2": 2.2e-4, "motor_constant_N_m_A": 0.0234, "resistance_ohm": 2.32, "inductance_H": 2.38e-4},
)
fit = rs.fit(log, model)
fit.to_frame()[["name", "value", "sigma", "unit"]]

# %%
print(f"rms of the rate: {fit.outputs['omega_rad_s'].ratio:.2f} × noise")
answer = rs.explain(log, model)
answer.verdict, answer.missing, answer.not_distinguishable

# %% [markdown]
# The second effect is real too: the rate of the simulated stand has passed a filter of 523 Hz, 0.3 ms, which its own logs state in a note and this file does not.
#
# An idea of one's own is an expression. It is fitted as the effects of the catalogue are.

# %%
own = fit.model.copy().add_expression(
    "breakaway", "a*exp(-abs(omega)/b)", adds_to="dry_N_m", parameters={"a": 1e-4, "b": 0.5}
)
fitted = rs.fit(log, own)
print(f"with the expression: {fitted.outputs['omega_rad_s'].ratio:.2f} × noise")
print(*(fitted.parameters[name] for name in ("breakaway.a", "breakaway.b")), sep="\n")

# %%
answer.model.write("bench.toml")
print(answer.model)
