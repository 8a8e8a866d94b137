"""PyMeasure driver of the rotary stand: drive, profiles and measured values over its SCPI line.

    from pymeasure.adapters import VISAAdapter
    from rotary_stand_pymeasure import RotaryStand

    adapter = VISAAdapter("TCPIP::127.0.0.1::5025::SOCKET", visa_library="@py",
                          read_termination="\\r\\n", write_termination="\\n")
    with RotaryStand(adapter) as stand:
        stand.rate = 1.0
        stand.mode = "RATE"
        print(stand.measured_rate)

A serial port is `VISAAdapter("ASRL/dev/ttyACM0::INSTR", baud_rate=921600, ...)`. The stand switches its drive off 2 s after the last command of
the program that drives; queries do not count. Set a value, call `keep_alive()` at least every 2 s, or set `unattended_time`. The end of the
`with` block switches the drive off, also after an exception.

Needs pymeasure 0.15 or later. Replies are plain numbers in SI units and radians.
"""

import time

from pymeasure.instruments import Instrument, SCPIMixin
from pymeasure.instruments.validators import strict_discrete_set, strict_range

#: Interval of the signs of life while a method waits, s; the stand waits for 2 s.
ALIVE_INTERVAL = 0.5


class RotaryStand(SCPIMixin, Instrument):
    """A rotary stand behind a VISA adapter."""

    def __init__(self, adapter, name="Rotary stand", **kwargs):
        super().__init__(adapter, name, **kwargs)
        # A terminal that was here before may have left units in the replies.
        self.write("FORMat:UNITs OFF")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.shutdown()

    mode = Instrument.control(
        "SOURce:MODE?",
        "SOURce:MODE %s",
        """Control the mode of the drive: OFF, VOLTAGE, RATE or POSITION; any but OFF switches it on with the setpoint of this mode.""",
        validator=strict_discrete_set,
        values=["OFF", "VOLTAGE", "RATE", "POSITION"],
        cast=str,
    )
    output_enabled = Instrument.control(
        "OUTPut?",
        "OUTPut %d",
        """Control whether the drive is on, in its last mode.""",
        validator=strict_discrete_set,
        values={True: 1, False: 0},
        map_values=True,
    )
    rate = Instrument.control(
        "SOURce:RATE?",
        "SOURce:RATE %.9g",
        """Control the setpoint of mode RATE, rad/s.""",
        validator=strict_range,
        values=[-34.906585, 34.906585],
    )
    voltage = Instrument.control(
        "SOURce:VOLTage?",
        "SOURce:VOLTage %.9g",
        """Control the setpoint of mode VOLTAGE, V.""",
        validator=strict_range,
        values=[-48, 48],
    )
    position = Instrument.control(
        "SOURce:POSition?",
        "SOURce:POSition %.9g",
        """Control the setpoint of mode POSITION, rad.""",
        validator=strict_range,
        values=[-1e4, 1e4],
    )
    unattended_time = Instrument.control(
        "HOST:UNATTended?",
        "HOST:UNATTended %.9g",
        """Control the time for which the drive may run without a sign of life of the program, s; reads the rest of it.""",
        validator=strict_range,
        values=[0, 1e6],
    )
    measured_rate = Instrument.measurement("MEASure:RATE?", """Get the rate of the platform, mean over 32 ms, rad/s.""")
    angle = Instrument.measurement("MEASure:ANGLe?", """Get the angle of the platform, not reduced to a turn, rad.""")
    current = Instrument.measurement("MEASure:CURRent?", """Get the motor current, mean over 1 ms, A.""")
    supply = Instrument.measurement("MEASure:SUPPly?", """Get the supply voltage of the bridge, V.""")
    temperature = Instrument.measurement("MEASure:TEMPerature?", """Get the temperature of the winding, °C.""")
    sensor_rate = Instrument.measurement("MEASure:GYRO?", """Get the rate that the sensor under test shows, rad/s.""")
    fault = Instrument.measurement(
        "FAULt?",
        """Get the latched fault: number (0: none), name, advice.""",
        maxsplit=2,
        get_process_list=lambda words: (int(words[0]), words[1], words[2]),
    )

    def keep_alive(self):
        """Give a sign of life of the program that drives."""
        self.write("HOST:ALIVe")

    def wait_until_done(self, should_stop=lambda: False, timeout=None):
        """Wait until no profile, calibration or self-test runs, with signs of life; False after `timeout` s or if `should_stop()` is true."""
        until = None if timeout is None else time.monotonic() + timeout
        while int(self.values("STATus:OPERation:CONDition?")[0]) & 0b10_0000_0001:
            if should_stop() or until is not None and time.monotonic() > until:
                return False
            self.keep_alive()
            time.sleep(ALIVE_INTERVAL)
        return True

    def run_profile(self, kind, mode="RATE", duration=None, **parameters):
        """Start a profile; its parameters by their names in `PROFile:TYPE:LIST?`, e.g. run_profile("sine", amplitude=2, frequency_Hz=0.5)."""
        self.write(f"PROFile:MODE {mode}")
        self.write(f"PROFile:TYPE {kind}")
        for name, value in parameters.items():
            self.write(f"PROFile:{name} {value:.9g}")
        if duration is not None:
            self.write(f"PROFile:DURation {duration:.9g}")
        self.require_no_error()
        self.write("PROFile:STARt")
        self.require_no_error()

    def require_no_error(self):
        """Raise ValueError with the errors of the stand's queue, if there are any."""
        errors = self.check_errors()
        if errors:
            raise ValueError("; ".join(f"{error[0]:g}, {error[1]}" for error in errors))

    def stop(self):
        """Stop the platform at once; `clear_fault()` allows motion again."""
        self.write("STOP")

    def clear_fault(self):
        """Clear the latched fault if its cause is gone; the drive stays off."""
        self.write("FAULt:CLEar")

    def help(self):
        """The commands of the stand, one per line."""
        return self.read_block("HELP?").splitlines()

    def read_block(self, query):
        """The text of a reply that is a definite-length block."""
        self.write(query)
        head = self.read_bytes(2)
        length = int(self.read_bytes(int(head[1:])))
        text = self.read_bytes(length).decode("ascii")
        self.read()
        return text

    def shutdown(self):
        """Switch the drive off."""
        self.write("OUTPut OFF")
        super().shutdown()
