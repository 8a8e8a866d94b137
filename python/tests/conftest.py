"""Logs and models that the tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

import rotary_stand as rs

#: The default stand by its data sheets.
NOMINAL = {
    "inertia_kg_m2": 2.2e-4,
    "motor_constant_N_m_A": 0.0234,
    "resistance_ohm": 2.32,
    "viscous_N_m_s": 1e-5,
    "coulomb_N_m": 8.6e-4,
    "inductance_H": 2.38e-4,
}


@pytest.fixture(scope="session")
def cogging_log(tmp_path_factory: pytest.TempPathFactory) -> rs.Log:
    """A log of the simulated stand with an effect that :func:`nominal` lacks."""
    return rs.simulated_log(tmp_path_factory.mktemp("logs") / "cogging.parquet", seconds=12, seed=3, hidden="cogging")


@pytest.fixture(scope="session")
def null_log(tmp_path_factory: pytest.TempPathFactory) -> rs.Log:
    """A log without a hidden effect."""
    return rs.simulated_log(tmp_path_factory.mktemp("logs") / "null.parquet", seconds=12, seed=5)


@pytest.fixture
def nominal() -> rs.Model:
    """The default stand by its data sheets, with the effects of every drive."""
    return rs.Model(["viscous", "coulomb", "inductance"], parameters=NOMINAL, name="nominal")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty folder."""
    return tmp_path
