//! An observer design written into a stand behind a serial port, by console commands that the stand checks.

use identification::parameters::NamesParameters;
use std::time::{Duration, Instant};

use stand_firmware::gyro_loop::observer::MAX_STATES;

use super::{Design, Disturbance, Element, Moment, RateResponse, discrete_loop_radius};
use stand_acquire::link::{LinkError, SerialLink};

/// Interval of the stand's rows, which is the step of its observer, s.
pub const ROW_INTERVAL_S: f64 = 1e-3;
/// Longest time that the stand checks the poles.
const CHECK_TIMEOUT: Duration = Duration::from_secs(3);
/// Shortest window of the vibration correction, a whole number of periods, s.
const MIN_VIBRATION_WINDOW_S: f64 = 5.0;
/// Interval between queries of the observer's phase.
const QUERY_INTERVAL: Duration = Duration::from_millis(50);

/// What is written beside the design.
#[derive(Debug, Clone, Copy)]
pub struct TransferRequest<'a> {
    /// Moment of the gyroscope's torquer per current, N m/A.
    pub torquer_N_m_A: f64,
    /// Gains of the regulator for the first states, N m per unit of the state; an estimated moment is fed forward in full.
    pub regulator: &'a [f64],
    /// The observer is saved in the stand's flash.
    pub save: bool,
}

/// Why the design was not written.
#[derive(Debug, thiserror::Error)]
pub enum TransferError {
    /// The serial line fails, or the stand rejects a command.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The design has no discrete form.
    #[error("the design has no discrete form, so it cannot be written into a stand")]
    NotDiscrete,
    /// The step differs from the stand's.
    #[error("the observer of the stand runs at a step of {ROW_INTERVAL_S} s: design it with this step instead of {0} s")]
    Step(f64),
    /// More gains than states.
    #[error("regulator: {gains} gains for {states} states; give at most one gain for each state")]
    TooManyGains {
        /// Gains given.
        gains: usize,
        /// States of the element.
        states: usize,
    },
    /// The regulator makes the closed loop unstable.
    #[error(
        "regulator: the closed loop at the stand's step has a pole of magnitude {radius:.6}, on or outside the unit circle: feedback would be unstable; nothing \
         was sent"
    )]
    UnstableLoop {
        /// Magnitude of the largest pole per step.
        radius: f64,
    },
    /// The torquer's constant is not positive.
    #[error("torquer_N_m_A = {0}: must be above 0 N m/A")]
    Torquer(f64),
    /// The observer has more states than the stand's.
    #[error("the observer has {0} states; the stand takes at most {MAX_STATES}")]
    TooManyStates(usize),
    /// The stand rejects the gains.
    #[error("{port}: the stand rejects the gains at its step; the observer is off (SYSTem:ERRor? in `stand console` gives the reason)")]
    Rejected {
        /// The port.
        port: String,
    },
}

impl NamesParameters for TransferError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            TransferError::Step(_) => vec!["step_s"],
            TransferError::TooManyGains { .. } | TransferError::UnstableLoop { .. } => vec!["regulator"],
            TransferError::Torquer(_) => vec!["torquer_N_m_A"],
            _ => Vec::new(),
        }
    }
}

/// Writes the design into the stand and switches its observer on; the phase of the observer afterwards.
///
/// # Errors
/// As [`TransferError`].
pub fn write_design(link: &mut SerialLink, design: &Design, request: &TransferRequest) -> Result<String, TransferError> {
    for command in commands(design, request)? {
        link.command(&command)?;
    }
    let until = Instant::now() + CHECK_TIMEOUT;
    let phase = loop {
        let phase = link.query("OBServer:PHASe?")?;
        if phase != "CHECKING" || Instant::now() > until {
            break phase;
        }
        std::thread::sleep(QUERY_INTERVAL);
    };
    if phase == "OFF" {
        return Err(TransferError::Rejected { port: link.name() });
    }
    if request.save {
        link.command("SETTings:SAVE")?;
    }
    Ok(phase)
}

/// Checks that the design can be written into a stand, without one.
///
/// # Errors
/// As [`TransferError`], without those of the line.
pub fn check(design: &Design, request: &TransferRequest) -> Result<(), TransferError> {
    commands(design, request).map(|_| ())
}

/// Commands that set the observer and switch it on.
///
/// # Errors
/// As [`check`].
pub fn commands(design: &Design, request: &TransferRequest) -> Result<Vec<String>, TransferError> {
    let discrete = design.discrete.as_ref().ok_or(TransferError::NotDiscrete)?;
    if (discrete.step_s - ROW_INTERVAL_S).abs() > 1e-12 {
        return Err(TransferError::Step(discrete.step_s));
    }
    let states = discrete.gains.len();
    let plant_states = design.gains.len();
    if request.regulator.len() > plant_states {
        return Err(TransferError::TooManyGains { gains: request.regulator.len(), states: plant_states });
    }
    if states > MAX_STATES {
        return Err(TransferError::TooManyStates(states));
    }
    if !(request.torquer_N_m_A.is_finite() && request.torquer_N_m_A > 0.0) {
        return Err(TransferError::Torquer(request.torquer_N_m_A));
    }
    if request.regulator.iter().any(|gain| *gain != 0.0) {
        let radius = discrete_loop_radius(discrete, request.regulator, plant_states);
        if radius.is_nan() || radius >= 1.0 {
            return Err(TransferError::UnstableLoop { radius });
        }
    }
    let mut regulator = request.regulator.to_vec();
    regulator.resize(states, 0.0);
    if discrete.has_disturbance {
        regulator[plant_states] = 1.0;
    }
    let list = |numbers: &[f64]| numbers.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(",");
    // Settling time of an initial error to 1 %, at least half a second.
    let run = design.simulate(Disturbance { angle_rad: 1e-3, moment: Moment::default() }, 5.0, 5e-3);
    let settle_s = run.settled_s.unwrap_or(5.0).max(0.5);
    let mut commands = vec![format!("OBServer:NEW {states},{}", if discrete.has_disturbance { "ON" } else { "OFF" })];
    commands.extend(discrete.phi.iter().enumerate().map(|(row, numbers)| format!("OBServer:PHI {},{}", row + 1, list(numbers))));
    commands.push(format!("OBServer:GAMMa {}", list(&discrete.gamma)));
    commands.push(format!("OBServer:GAIN {}", list(&discrete.gains)));
    commands.push(format!("OBServer:REGulator {}", list(&regulator)));
    commands.push(format!("OBServer:TORQuer {:e}", request.torquer_N_m_A));
    commands.push(format!("OBServer:SETTle {settle_s:e}"));
    if let (Element::Four(element), Some(vibration_Hz)) = (design.request.plant.element, design.request.vibration_Hz) {
        let stiffness = element.azimuth_stiffness_N_m_rad();
        let window_s = (MIN_VIBRATION_WINDOW_S * vibration_Hz).ceil() / vibration_Hz;
        let gains = [window_s, element.rotor_N_m_s / stiffness, (element.inertia_x_kg_m2 - element.inertia_z_kg_m2) / stiffness];
        commands.push(format!("OBServer:VIBRation {}", list(&gains)));
        if let Some(response) = RateResponse::new(discrete, &element, vibration_Hz) {
            commands.push(format!("OBServer:RESPonse {}", list(&response.console_numbers())));
        }
    }
    commands.push("OBServer:STATe ON".to_owned());
    Ok(commands)
}
