"""Instrument libraries at a served stand, one after the other: `python3 scpi_clients.py PORT`. Prints what a library reads; an assertion ends it."""

import sys
from pathlib import Path

import pyvisa
from instruments.generic_scpi import SCPIInstrument
from pymeasure.adapters import VISAAdapter
from pymeasure.instruments import Instrument, SCPIMixin

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))
from rotary_stand_pymeasure import RotaryStand  # noqa: E402

port = int(sys.argv[1])
resource = f"TCPIP::127.0.0.1::{port}::SOCKET"
ends = {"read_termination": "\r\n", "write_termination": "\n"}


def pyvisa_reads_values():
    with pyvisa.ResourceManager("@py").open_resource(resource, timeout=5000, **ends) as stand:
        assert stand.query_ascii_values("SYSTem:VERSion?") == [1999.0]
        # Every numeric query gives plain numbers, MIN, MAX and DEF too.
        assert stand.query_ascii_values("SOURce:RATE? MAX;:SOURce:VOLTage? MIN;:PROFile:AMPLitude? DEF", separator=";") == [34.9065850, -48, 5]
        assert len(stand.query_ascii_values("MEASure:TIMing?")) == 6
        stability = stand.query_ascii_values("MEASure:STABility?")
        assert len(stability) == 9
        help_text = bytes(stand.query_binary_values("HELP?", datatype="B", container=bytes, expect_termination=True)).decode("ascii")
        assert "*IDN? -> " in help_text and help_text.splitlines()[-1].startswith("SETTings:")
        assert stand.query("*OPC?") == "1", "nothing of the block is left over"
        stand.write("NONSENSE")
        stand.write("SOURce:RATE 1 V")
        errors = stand.query("SYSTem:ERRor:ALL?")
        assert errors.startswith('-113,"Undefined header') and ',-131,"Invalid suffix' in errors, errors
        assert stand.query("SYSTem:ERRor:ALL?") == '0,"No error"'
        stand.write("FORMat:UNITs ON")
        print("PyVISA", stand.query("SOURce:RATE?"))
        stand.write("*RST")


def pymeasure_reads_a_generic_instrument():
    class Generic(SCPIMixin, Instrument):
        """An instrument with the common commands alone."""

    stand = Generic(VISAAdapter(resource, visa_library="@py", **ends), "generic")
    assert stand.complete == "1" and stand.options == "0"
    stand.clear()
    stand.reset()
    stand.write("NONSENSE")
    errors = stand.check_errors()
    assert len(errors) == 1 and errors[0][0] == -113, errors
    print("PyMeasure", stand.id)
    stand.adapter.close()


def instrumentkit_reads_a_generic_instrument():
    stand = SCPIInstrument.open_tcpip("127.0.0.1", port)
    stand.terminator = "\n"
    assert stand.scpi_version.strip() == "1999.0" and stand.op_complete and stand.power_on_status and stand.self_test_ok
    stand.clear()
    assert stand.check_error_queue() == []
    stand.sendcmd("NONSENSE")
    assert stand.check_error_queue() == [-113]
    stand.wait_to_continue()
    stand.reset()
    print("InstrumentKit", stand.name.strip())
    stand._file._conn.close()


def driver_turns_the_platform_and_stops_it():
    adapter = VISAAdapter(resource, visa_library="@py", **ends)
    with RotaryStand(adapter) as stand:
        assert any(line.startswith("SOURce:RATE ") for line in stand.help())
        stand.rate = 2.0
        assert abs(stand.rate - 2.0) < 1e-9 and stand.mode == "OFF"
        stand.mode = "RATE"
        for _ in range(3):
            stand.keep_alive()
            stand.wait_until_done()
        while abs(stand.measured_rate - 2.0) > 0.05:
            stand.keep_alive()
        assert stand.output_enabled is True and stand.fault[0] == 0 and 5 < stand.supply < 50
        stand.run_profile("turns", amplitude=10, turns=1, duration=2)
        assert stand.wait_until_done(timeout=20)
        try:
            stand.run_profile("sine", amplitude=1e9)
        except ValueError as error:
            assert "above the maximum" in str(error), error
        else:
            raise AssertionError("an amplitude of 1e9 was accepted")
        stand.rate = 1.0
        stand.mode = "RATE"
        try:
            with stand:
                raise RuntimeError("the script fails")
        except RuntimeError:
            pass
        state = (stand.output_enabled, stand.mode)
        assert state == (False, "OFF"), state
        print("driver", stand.fault)
    adapter.close()


for client in [
    pyvisa_reads_values,
    pymeasure_reads_a_generic_instrument,
    instrumentkit_reads_a_generic_instrument,
    driver_turns_the_platform_and_stops_it,
]:
    client()
