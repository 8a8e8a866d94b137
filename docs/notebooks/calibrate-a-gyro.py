# %% [markdown]
# # Calibrate a rate gyro
#
# The default session runs on the simulated stand in virtual time; a seed draws the gyro. On a real stand, `stand calibrate gyro --port PORT --out session` runs it
# and `rs.calibrate("session")` computes the record. Every quantity has an uncertainty by GUM with its budget.

# %%
import matplotlib.pyplot as plt

import rotary_stand as rs

record = rs.calibrate_simulated("session", seed=4, serial="G-1", operator="Ann")
record.to_frame()

# %%
print(record)

# %% [markdown]
# The budget of the scale: what contributes to its uncertainty.

# %%
record.budget("scale")

# %%
record.plot()
plt.show()

# %% [markdown]
# The raw logs are in the folder and are ordinary logs. The noise of the gyro at rest, by the Allan deviation:

# %%
rest = rs.allan("session/01-rest.parquet", "gyro_rad_s")
print(rest)
rest.plot()
plt.show()

# %% [markdown]
# The response over the frequency, from the record's data (docs/json.md):

# %%
response = record.data["record"]["frequency_response"]
figure, (gain, phase) = plt.subplots(2, 1, sharex=True, figsize=(8, 4), layout="constrained")
frequency = [point["frequency_Hz"] for point in response]
gain.errorbar(frequency, [p["gain"] for p in response], yerr=[p["U_gain"] for p in response], marker="o", markersize=3)
gain.set_ylabel("gain")
phase.errorbar(frequency, [p["phase_deg"] for p in response], yerr=[p["U_phase_deg"] for p in response], marker="o", markersize=3)
phase.set_ylabel("phase, °")
phase.set_xlabel("frequency, Hz")
plt.show()
