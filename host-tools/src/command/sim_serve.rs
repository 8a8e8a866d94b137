//! `stand sim --serve pty`: the whole simulated controller in real time, behind a serial port that any program opens.

use std::sync::atomic::Ordering;
use std::time::Duration;

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::plant::Plant;

use super::error::CliError;
use super::output::{check_place, print};
use super::sim::Sim;

impl Sim {
    #[cfg(not(unix))]
    pub(super) fn serve(&self) -> Result<(), CliError> {
        Err(CliError::Input("--serve pty: this system has no pseudo-terminals".to_owned()))
    }

    /// The whole controller behind a port, until somebody ends it.
    #[cfg(unix)]
    pub(super) fn serve(&self) -> Result<(), CliError> {
        let mut stand = super::sim::stand(self.stand.as_ref())?;
        let hidden = match &self.hidden {
            Some(word) => Some(crate::acquire::hidden::hide(word, &mut stand).map_err(|e| CliError::Input(format!("--hidden: {e}")))?),
            None => None,
        };
        let until = match self.seconds {
            Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
                return Err(CliError::Input(format!("--seconds: {seconds} is outside 0 … 1e9")));
            }
            seconds => seconds.map_or(Duration::MAX, Duration::from_secs_f64),
        };
        let mut flash = flash(self.seed);
        if let Some(path) = &self.flash {
            check_place(path)?;
            match std::fs::read(path) {
                Ok(bytes) => flash.load(&bytes),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
                Err(e) => return Err(CliError::file(path, "read", &e)),
            }
        }
        let clock = VirtualClock::default();
        // Anywhere on the turn: a platform seldom stands at its index.
        let plant = Plant::new(&stand, -2.0)?;
        let mut controller =
            Controller::new(&clock, &stand.setup(), plant, flash, self.seed).map_err(|e| CliError::Input(e.to_string()))?;
        if let Some(path) = &self.gyro {
            let gyro = super::drift::gyro(path.as_deref())?;
            controller = controller.with_gyro(Box::new(gyro.seeded(self.seed)), self.seed);
        }
        let interrupted = super::record::interrupts()?;
        let mut pty = crate::acquire::serve::Pty::open(self.link.as_deref()).map_err(|e| CliError::Input(e.to_string()))?;
        // The path alone on standard output: a script reads one line.
        print(&format!("{}\n", pty.path().display()))?;
        let second = self.link.as_ref().map_or(String::new(), |link| format!(" (also {})", link.display()));
        eprintln!(
            "the simulated stand is at {}{second}, 921600 baud; `stand console --port …` talks to it, Ctrl-C ends it",
            pty.path().display()
        );
        if let (Some(hidden), true) = (&hidden, self.reveal) {
            eprintln!("hidden: {hidden}");
        }
        let over = |now: Duration| interrupted.load(Ordering::Relaxed) > 0 || now >= until;
        let served = crate::acquire::serve::serve(&controller, &mut pty, over, |behind| {
            eprintln!(
                "stand: this computer is too slow for real time: the stand's clock is {:.1} s behind from here on",
                behind.as_secs_f64()
            );
        });
        if let Some(path) = &self.flash {
            std::fs::write(path, controller.into_flash().bytes()).map_err(|e| CliError::file(path, "write", &e))?;
        }
        if pty.lost() > 0 {
            eprintln!("stand: {} bytes were lost because a client did not read them", pty.lost());
        }
        served.map_err(|e| CliError::Other(e.to_string()))
    }
}
