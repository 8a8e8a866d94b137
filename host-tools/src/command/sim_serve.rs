//! `stand sim --serve pty`: the complete simulated controller in real time, as a serial port for other programs.

use std::path::Path;

use super::error::CliError;

/// Options of a served stand.
pub(super) struct ServeOptions<'a> {
    /// Symbolic link to the port.
    pub link: Option<&'a Path>,
    /// File with the flash contents.
    pub flash: Option<&'a Path>,
    /// A gyroscope is connected; its file.
    pub gyroscope: Option<Option<&'a Path>>,
    /// Time until the stand ends, s.
    pub seconds: Option<f64>,
    /// Effect that the stand's model lacks.
    pub hidden: Option<&'a str>,
    /// The hidden effect is printed.
    pub reveal: bool,
    /// Description of the stand.
    pub stand: Option<&'a Path>,
    /// Seed of the sensor noise.
    pub seed: u64,
}

/// Serves the stand until its time has passed or a signal arrives.
#[cfg(not(unix))]
pub(super) fn serve(_: ServeOptions) -> Result<(), CliError> {
    Err(CliError::Input("--serve pty: this operating system has no pseudo-terminals".to_owned()))
}

/// Serves the stand until its time has passed or a signal arrives.
#[cfg(unix)]
pub(super) fn serve(options: ServeOptions) -> Result<(), CliError> {
    use std::time::Duration;

    use hal_sim::clock::VirtualClock;
    use hal_sim::controller::{Controller, flash};
    use hal_sim::plant::Plant;

    use super::output::{check_writable, print};
    use super::signals::Interrupts;
    use super::stand_file::{hide_effect, read_gyroscope, read_stand};
    use crate::acquire::serve::{Pty, serve};

    /// Angle of the platform at power-on, rad: not at the index, as on most stands.
    const START_ANGLE_RAD: f64 = -2.0;

    let mut stand = read_stand(options.stand)?;
    let hidden = hide_effect(options.hidden, &mut stand)?;
    let until = match options.seconds {
        Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
            return Err(CliError::Input(format!("--seconds: {seconds} is outside 0 … 1e9")));
        }
        seconds => seconds.map_or(Duration::MAX, Duration::from_secs_f64),
    };
    let mut flash = flash(options.seed);
    if let Some(path) = options.flash {
        check_writable(path)?;
        match std::fs::read(path) {
            Ok(bytes) => flash.load(&bytes),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(CliError::file(path, "read", &e)),
        }
    }
    let clock = VirtualClock::default();
    let plant = Plant::new(&stand, START_ANGLE_RAD)?;
    let mut controller = Controller::new(&clock, &stand.setup(), plant, flash, options.seed).map_err(|e| CliError::Input(e.to_string()))?;
    if let Some(file) = options.gyroscope {
        let gyroscope = read_gyroscope(file)?;
        controller = controller.with_gyro(Box::new(gyroscope.seeded(options.seed)), options.seed);
    }
    let interrupts = Interrupts::install()?;
    let mut pty = Pty::open(options.link).map_err(|e| CliError::Input(e.to_string()))?;
    // Standard output carries the path alone, so that a script reads one line.
    print(&format!("{}\n", pty.path().display()))?;
    let link = options.link.map_or(String::new(), |link| format!(" (link: {})", link.display()));
    eprintln!(
        "Simulated stand at {}{link}, 921600 baud. `stand console --port …` opens a console; Ctrl-C ends the stand.",
        pty.path().display()
    );
    if let (Some(hidden), true) = (&hidden, options.reveal) {
        eprintln!("hidden effect: {hidden}");
    }
    let ended = |now: Duration| interrupts.any() || now >= until;
    let served = serve(&controller, &mut pty, ended, |lag| {
        eprintln!("stand: the computer is too slow for real time; the simulated clock now lags by a further {:.1} s", lag.as_secs_f64());
    });
    if let Some(path) = options.flash {
        std::fs::write(path, controller.into_flash().bytes()).map_err(|e| CliError::file(path, "write", &e))?;
    }
    if pty.lost() > 0 {
        eprintln!("stand: {} bytes were lost because a client did not read them", pty.lost());
    }
    served.map_err(|e| CliError::Other(e.to_string()))
}
