//! `stand sim --serve pty|tcp:PORT`: the complete simulated controller in real time, as a serial or TCP port for other programs.

use std::path::Path;

use chip_sim::image::Image;

use super::error::CliError;

/// Interface of a served stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ServedInterface {
    /// A pseudo-terminal, which any program opens as a serial port.
    Pty,
    /// A TCP port of the loopback interface; 0: a free one.
    Tcp(u16),
}

impl std::str::FromStr for ServedInterface {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("tcp:")) {
            ("pty", _) => Ok(Self::Pty),
            (_, Some(port)) => port.parse().map(Self::Tcp).map_err(|_| format!("`{port}` is not a port number, 0 to 65535")),
            _ => Err("must be `pty` or `tcp:PORT`".to_owned()),
        }
    }
}

/// Options of a served stand.
pub(super) struct ServeOptions<'a> {
    /// Its interface.
    pub interface: ServedInterface,
    /// The emulated chip is served; its image.
    pub chip: Option<Option<&'a Path>>,
    /// Symbolic link to the port.
    pub link: Option<&'a Path>,
    /// File with the flash contents.
    pub flash: Option<&'a Path>,
    /// A gyroscope is connected; its file.
    pub gyroscope: Option<Option<&'a Path>>,
    /// Multiple of real time at which it runs.
    pub speed: f64,
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
    Err(CliError::Input("--serve: not available on this operating system".to_owned()))
}

/// Serves the stand until its time has passed or a signal arrives.
#[cfg(unix)]
pub(super) fn serve(options: ServeOptions) -> Result<(), CliError> {
    use std::time::Duration;

    use chip_sim::board::Board;
    use chip_sim::machine::Machine;
    use hal_sim::clock::VirtualClock;
    use hal_sim::controller::{Controller, flash};
    use hal_sim::plant::Plant;

    use super::output::{check_writable, print};
    use super::signals::Interrupts;
    use super::stand_file::{hide_effect, read_gyroscope, read_stand};
    use identification::files;
    use stand_acquire::serve::{Pty, ServedLine, TcpPort, serve, serve_chip};
    use std::io::Write as _;

    /// Angle of the platform at power-on, rad: not at the index, as on most stands.
    const START_ANGLE_RAD: f64 = -2.0;
    /// Slowest and fastest stand, multiples of real time. A host gives a sign of life every 0.2 s, and the stand waits 2 s of its time for it.
    const MIN_SPEED: f64 = 0.1;
    const MAX_SPEED: f64 = 5.0;
    /// Sectors of the settings in the chip's flash (memory.x).
    const SETTINGS: std::ops::Range<usize> = 0x4000..0xC000;

    let mut stand = read_stand(options.stand)?;
    let hidden = hide_effect(options.hidden, &mut stand)?;
    let until = match options.seconds {
        Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
            return Err(CliError::Input(format!("--seconds: {seconds} is outside 0 … 1e9")));
        }
        seconds => seconds.map_or(Duration::MAX, Duration::from_secs_f64),
    };
    if !(MIN_SPEED..=MAX_SPEED).contains(&options.speed) {
        return Err(CliError::Input(format!("--speed: {} is outside {MIN_SPEED} … {MAX_SPEED}", options.speed)));
    }
    let kept = match options.flash {
        None => None,
        Some(path) => {
            check_writable(path)?;
            match std::fs::read(path) {
                Ok(bytes) => Some(bytes),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => None,
                Err(e) => return Err(CliError::file(path, "read", &e)),
            }
        }
    };
    let ended = |interrupts: &Interrupts, now: Duration| interrupts.any() || now >= until;
    let lag_s = std::cell::Cell::new(0.0);
    let mut lagged = |lag: Duration| {
        if lag_s.replace(lag_s.get() + lag.as_secs_f64()) == 0.0 {
            eprintln!("stand: the computer is too slow; the simulated clock lags");
        }
    };
    let report_lag = || {
        if lag_s.get() > 0.0 {
            eprintln!("stand: the simulated clock lags real time by {:.1} s", lag_s.get());
        }
    };
    let open = || -> Result<ServedLine, CliError> {
        let line = match (options.interface, options.link) {
            (ServedInterface::Pty, link) => ServedLine::Pty(Pty::open(link).map_err(|e| CliError::Input(e.to_string()))?),
            (ServedInterface::Tcp(_), Some(_)) => return Err(CliError::Input("--link: only --serve pty has a path to link to".to_owned())),
            (ServedInterface::Tcp(port), None) => {
                ServedLine::Tcp(TcpPort::open(port).map_err(|e| CliError::Other(format!("--serve tcp:{port}: {e}")))?)
            }
        };
        // Standard output carries the name of the port alone, so that a script reads one line.
        print(&format!("{}\n", line.name()))?;
        let link = options.link.map_or(String::new(), |link| format!(" (link: {})", link.display()));
        let what = if options.chip.is_some() { "Emulated chip" } else { "Simulated stand" };
        eprintln!("{what} at {}{link}, 921600 baud. `stand console --port …` opens a console; Ctrl-C ends it.", line.name());
        if let (Some(hidden), true) = (&hidden, options.reveal) {
            eprintln!("hidden effect: {hidden}");
        }
        Ok(line)
    };
    if let Some(image) = options.chip {
        let image = read_image(image)?;
        let plant = Plant::new(&stand, START_ANGLE_RAD)?;
        let board = Board::new(&stand.setup(), Box::new(plant), stand.drive.motor_constant_N_m_A, options.seed);
        let mut machine = Machine::new(&image, board);
        if let (Some(bytes), Some(sectors)) = (&kept, machine.soc.flash.bytes_mut().get_mut(SETTINGS)) {
            sectors.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        }
        let interrupts = Interrupts::install()?;
        let mut line = open()?;
        let served = serve_chip(&mut machine, &mut line, options.speed, &|now| ended(&interrupts, now), &mut lagged);
        report_lag();
        if let (Some(path), Some(sectors)) = (options.flash, machine.soc.flash.bytes().get(SETTINGS)) {
            files::replace(path, |out| out.write_all(sectors)).map_err(|e| CliError::file(path, "write", &e))?;
        }
        return served.map_err(|e| CliError::Other(e.to_string()));
    }
    let mut flash = flash(options.seed);
    if let Some(bytes) = &kept {
        flash.load(bytes);
    }
    let clock = VirtualClock::default();
    let plant = Plant::new(&stand, START_ANGLE_RAD)?;
    let mut controller = Controller::new(&clock, &stand.setup(), plant, flash, options.seed).map_err(|e| CliError::Input(e.to_string()))?;
    if let Some(file) = options.gyroscope {
        let gyroscope = read_gyroscope(file)?;
        controller = controller.with_gyro(Box::new(gyroscope.seeded(options.seed)), options.seed);
    }
    let interrupts = Interrupts::install()?;
    let mut line = open()?;
    let served = serve(&controller, &mut line, options.speed, &|now| ended(&interrupts, now), &mut lagged);
    report_lag();
    if let Some(path) = options.flash {
        files::replace(path, |out| out.write_all(controller.into_flash().bytes())).map_err(|e| CliError::file(path, "write", &e))?;
    }
    if line.lost() > 0 {
        eprintln!("stand: {} bytes were lost because a client did not read them", line.lost());
    }
    served.map_err(|e| CliError::Other(e.to_string()))
}

/// The image to emulate: the given file, or the one that the build script has made below the present folder.
pub(super) fn read_image(given: Option<&Path>) -> Result<Image, CliError> {
    const BUILT: [&str; 2] = ["target/firmware/thumbv7em-none-eabihf/chip/stand", "target/thumbv7em-none-eabihf/chip/stand"];
    let path = given.or_else(|| BUILT.iter().map(Path::new).find(|path| path.exists())).ok_or_else(|| {
        CliError::Input(format!("--chip: no image at {}: run scripts/build-firmware.sh, or name an ELF file", BUILT.join(" or ")))
    })?;
    Image::read(path).map_err(|e| CliError::Input(e.to_string()))
}
