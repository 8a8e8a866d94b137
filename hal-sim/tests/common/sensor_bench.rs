//! The sensor under test on a platform with a known motion, read by the firmware's task.

use embassy_futures::select::select;
use hal_sim::board::{Bench, PlantPort, SimBoard};
use hal_sim::clock::{self, SimClock, VirtualClock};
use hal_sim::peripherals::SensorSetup;
use hal_sim::peripherals::imu::ImuSetup;
use stand_firmware::board::{Board, Clock, Hardware, TICKS_PER_S, TickIo, Ticks};
use stand_firmware::sensors::{DetectedSensor, Runner, Shared, Status};
use std::cell::RefCell;

/// A platform that turns with a constant acceleration.
pub struct Turning {
    pub t_s: f64,
    pub from_rad_s: f64,
    pub acceleration_rad_s2: f64,
}

impl PlantPort for Turning {
    fn advance(&mut self, _: f64, dt_s: f64) {
        self.t_s += dt_s;
    }
    fn theta_rad(&self) -> f64 {
        self.from_rad_s * self.t_s + 0.5 * self.acceleration_rad_s2 * self.t_s * self.t_s
    }
    fn rate_rad_s(&self) -> f64 {
        self.from_rad_s + self.acceleration_rad_s2 * self.t_s
    }
    fn mean_current_A(&self) -> f64 {
        0.0
    }
    fn supply_V(&self) -> f64 {
        12.0
    }
    fn temp_C(&self) -> f64 {
        60.0
    }
    fn true_theta_rad(&self) -> f64 {
        self.theta_rad()
    }
}

pub const STILL: Turning = Turning { t_s: 0.0, from_rad_s: 0.0, acceleration_rad_s2: 0.0 };

/// Runs the sensor task for `seconds`; calls `each` with its state and the bench at each millisecond.
pub fn run(plant: Turning, setup: ImuSetup, seconds: f64, mut each: impl FnMut(u64, &Shared, &mut Bench)) -> Status {
    let clock = VirtualClock::default();
    let bench = RefCell::new(Bench::new(&Hardware::default(), &SensorSetup::default(), 1, Box::new(plant)).with_imu(setup, 1));
    let mut board = SimBoard::new(&bench, &clock);
    let line = board.sensor_bus().unwrap();
    assert!(board.sensor_bus().is_none(), "the bus is handed out once");
    let shared = Shared::default();
    let mut runner = Runner::new(DetectedSensor::new(line, SimClock(&clock)), SimClock(&clock), &shared);
    let watch = async {
        let clock = SimClock(&clock);
        for ms in 1..=(seconds * 1e3) as u64 {
            clock.until(Ticks(ms * TICKS_PER_S / 1000)).await;
            each(ms, &shared, &mut bench.borrow_mut());
        }
    };
    clock::run(&clock, select(watch, runner.run()), |to| bench.borrow_mut().advance(to, |io| _ = io.sense())).unwrap();
    shared.status()
}
