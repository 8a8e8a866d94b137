//! The setup of a simulated stand apart from its plant: scales, sensors, settings of the firmware, faults.

use stand_firmware::board::Hardware;
use stand_firmware::speed_loop::Settings;

use crate::faults::Faults;
use crate::peripherals::imu::ImuSetup;
use crate::peripherals::{ClockSetup, SensorSetup};

/// The stand apart from its plant: scales, sensors, settings of the firmware.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StandSetup {
    /// Scales of the converters.
    pub hardware: Hardware,
    /// Noise and filters of the sensors.
    pub sensors: SensorSetup,
    /// The speed loop's gains and limits.
    pub settings: Settings,
    /// Faults.
    pub faults: Faults,
    /// The sensor under test, if the platform carries one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuSetup>,
    /// Crystal of the controller, and the reference beside it.
    #[serde(skip_serializing_if = "ClockSetup::is_default")]
    pub clock: ClockSetup,
}

impl StandSetup {
    /// No noise, no filter, and converter steps too fine to matter; the encoder keeps its resolution.
    pub fn ideal() -> Self {
        let hardware = Hardware {
            current_A_per_code: 4e-9,
            current_zero_code: 1_073_741_824.0, // 2³⁰ codes, the most that a code of 31 bits shows: ± 4.3 A
            rate_rad_s_per_code: 5e-8,          // 32 bits: ± 107 rad/s
            supply_V_per_code: 1e-8,
            temperature_C_per_code: 1e-6,
            ..Hardware::default()
        };
        Self { hardware, sensors: SensorSetup::ideal(), ..Self::default() }
    }
}
