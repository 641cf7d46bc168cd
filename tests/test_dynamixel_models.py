from pathlib import Path

import dynamixel_easy_sdk
import pytest

from ikns.errors import InvalidInput
from ikns.finger.models import MODELS, alert_text, model_named

TABLES = Path(dynamixel_easy_sdk.__file__).parent / "control_table"
#: ROBOTIS e-Manual, AX-12A: what the finger uses, as the page gives it.
AX12 = {
    "min_position_limit": (6, 2),
    "max_position_limit": (8, 2),
    "temperature_limit": (11, 1),
    "pwm_limit": (14, 2),
    "shutdown": (18, 1),
    "torque_enable": (24, 1),
    "goal_position": (30, 2),
    "profile_velocity": (32, 2),
    "goal_pwm": (34, 2),
    "present_position": (36, 2),
    "present_velocity": (38, 2),
    "present_load": (40, 2),
    "present_input_voltage": (42, 1),
    "present_temperature": (43, 1),
    "moving": (46, 1),
}


def in_sdk(file):
    """Address and size by name, as the SDK's own tables have them."""
    lines = (TABLES / file).read_text().split("[control table]")[1].splitlines()
    rows = [line.split("\t") for line in lines if line[:1].isdigit()]
    return {
        row[2].lower().replace(" ", "_"): (int(row[0]), int(row[1])) for row in rows
    }


@pytest.mark.parametrize(
    ("model", "file"),
    [
        ("xl430", "xl430_w250.model"),
        ("xm430", "xm430_w350.model"),
        ("xm430", "xm430_w210.model"),
        ("mx28", "mx_28.model"),
    ],
)
def test_registers_are_where_the_sdk_has_them(model, file):
    theirs = in_sdk(file)
    theirs["shadow_id"] = theirs.pop("secondary(shadow)_id")
    theirs["protocol_type"] = theirs.get(
        "protocol_type", theirs.get("protocol_version")
    )
    for name, register in MODELS[model].registers.items():
        assert (register.address, register.size) == theirs[name], name


def test_registers_of_the_ax_12_are_where_the_manual_has_them():
    for name, place in AX12.items():
        register = MODELS["ax12"][name]
        assert (register.address, register.size) == place, name


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda model: model.name)
def test_registers_do_not_overlap_and_keep_their_values(model):
    registers = sorted(model.registers.values(), key=lambda r: r.address)
    for one, other in zip(registers, registers[1:], strict=False):
        assert one.end <= other.address
    for register in registers:
        for value in {register.lower, register.upper, register.initial}:
            data = register.to_bytes(value)
            assert len(data) == register.size
            assert register.from_bytes(data) == value


def test_a_sign_in_bit_10_is_read():
    load = MODELS["ax12"]["present_load"]
    assert load.from_bytes(bytes.fromhex("00 06")) == -512
    assert load.from_bytes(bytes.fromhex("00 02")) == 512


def test_alerts_have_names_and_unknown_models_are_refused():
    assert alert_text(1 << 2, 1) == alert_text(1 << 2, 2) == "overheating"
    with pytest.raises(InvalidInput, match=r"unknown servo model 'hs53', expected"):
        model_named("hs53")
