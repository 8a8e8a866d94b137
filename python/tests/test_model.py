"""Models: effects, parameters, expressions, errors."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest

import rotary_stand as rs


def test_parameters_are_attributes_and_items(nominal: rs.Model) -> None:
    nominal.inertia_kg_m2 = 3e-4
    assert nominal["inertia_kg_m2"] == nominal.inertia_kg_m2 == 3e-4
    nominal["coulomb_N_m"] = 1e-3
    assert nominal.parameters["coulomb_N_m"] == 1e-3
    assert "inertia_kg_m2" in dir(nominal)


def test_effects_are_added_and_removed(nominal: rs.Model) -> None:
    assert nominal.add("cogging", "cogging").effects[-2:] == ["cogging", "cogging#2"]
    nominal["cogging_N_m#2"] = 1e-3
    assert nominal.remove("cogging#2").effects[-1] == "cogging"


def test_expression_is_an_effect(nominal: rs.Model) -> None:
    nominal.add_expression("seal", "-a*tanh(omega/b)", parameters={"a": 1e-4, "b": 1.0})
    assert nominal.effects[-1] == "seal" and nominal["seal.a"] == 1e-4
    with pytest.raises(rs.ModelError):
        nominal.add_expression("bad", "a*(omega")
    with pytest.raises(ValueError, match="adds_to"):
        nominal.add_expression("bad", "omega", adds_to="torque")
    assert nominal.effects[-1] == "seal"


def test_file_keeps_the_model(nominal: rs.Model, folder: Path) -> None:
    nominal.fix("resistance_ohm").write(folder / "m.toml")
    back = rs.Model.read(folder / "m.toml")
    assert back.parameters == nominal.parameters and back.fixed == {"resistance_ohm"}
    assert back.free("resistance_ohm").fixed == set()
    assert pickle.loads(pickle.dumps(nominal)) == nominal == copy.deepcopy(nominal)


def test_copy_is_another_model(nominal: rs.Model) -> None:
    other = nominal.copy()
    other.inertia_kg_m2 = 1e-3
    assert nominal.inertia_kg_m2 != other.inertia_kg_m2


def test_errors_name_the_place(folder: Path, nominal: rs.Model) -> None:
    with pytest.raises(rs.ModelError) as caught:
        rs.Model.parse('[drive]\ninput = "u_V"\neffects = ["cogging", "kogging"]\n', "drive.toml")
    assert (caught.value.path, caught.value.line) == ("drive.toml", 3) and "cogging" in str(caught.value)
    with pytest.raises(rs.ModelError):
        rs.Model.read(folder / "missing.toml")
    with pytest.raises(rs.ModelError):
        nominal.inertia_kg_m2 = -1.0
    with pytest.raises(rs.ModelError):
        nominal["inertia_kg_m2"] = float("nan")
    with pytest.raises(AttributeError, match="no parameter"):
        nominal.inertia = 1.0
    with pytest.raises(rs.ModelError):
        nominal.add("kogging")
    with pytest.raises(ValueError, match="input"):
        rs.Model(input="voltage")
    with pytest.raises(TypeError):
        rs.Model("cogging")
    with pytest.raises((TypeError, ValueError)):
        nominal["inertia_kg_m2"] = "heavy"  # type: ignore[assignment]


def test_linear_axis(folder: Path) -> None:
    model = rs.Model(["viscous", "coulomb"], input="force_N", axis="linear")
    assert "mass_kg" in model.parameters


def test_views(nominal: rs.Model) -> None:
    assert "coulomb" in repr(nominal) and "inertia_kg_m2" in str(nominal)
    assert "<table>" in nominal._repr_html_() and len(nominal.to_frame()) == 6


def test_catalogue() -> None:
    assert len(rs.effects().to_frame()) >= 39
    assert rs.effects("cogging").data["id"] == "cogging"
    with pytest.raises(ValueError, match="did you mean"):
        rs.effects("coging")
