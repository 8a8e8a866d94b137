//! The simulated board: the firmware's hardware traits on top of a plant.
//!
//! Input: a plant behind [`PlantPort`]. Output: [`SimTickIo`] for the 10 kHz interrupt and [`SimBoard`] for the tasks, joined in
//! a [`Bench`], which holds plant, sensors and bridge. A command of the interrupt takes effect one tick later, for one whole
//! tick. A tick allocates nothing and uses no dynamic dispatch.

pub mod linear_motor;
mod sensor_bus;

use crate::clock::{SimClock, VirtualClock};
use crate::faults::{ActiveFaults, Decoder, FaultKind, Faults};
use crate::gyro::{GyroLine, GyroPort};
use crate::peripherals::imu::{self as chip, Imu, ImuSetup};
use crate::peripherals::{
    ClockSetup, Crystal, CurrentAdc, Edges, Encoder, Index, Noise, RateSensor, ReferencePulses, SensorSetup, SlowChannel, TaskEdge,
};
use crate::setup::StandSetup;
use embedded_hal_async::spi::{MODE_3, Mode};
pub use sensor_bus::SensorBus;
use stand_firmware::board::{
    Board, CONTROL_PER_ROW, CurrentSum, Drive, Edge, EdgeTime, EncoderCount, GyroSample, Hardware, RateCode, RollCode, Sensed, Stamped,
    SupplyCode, TICKS_PER_CONTROL, TICKS_PER_S, TemperatureCode, TickIo, Ticks, TorquerStep,
};
use std::cell::RefCell;

/// Control ticks without an output after which the hardware switches the bridge off: 4 ms (TIM8 and DMA on the chip).
pub const OUTPUT_TIMEOUT_TICKS: u32 = 40;
/// Control ticks between two samples of the rate sensor (BMG160: output rate 2 kHz).
const RATE_SENSOR_EVERY: u64 = 5;

/// The interface of a plant. Angles in rad; a positive voltage turns towards a positive angle.
pub trait PlantPort {
    /// Advances by `dt_s` with the commanded voltage `command_V` (at nominal supply; 0 when off).
    fn advance(&mut self, command_V: f64, dt_s: f64);
    /// Angle reading of the encoder disc before quantisation.
    fn theta_rad(&self) -> f64;
    /// Rate reading of the sensor element (with scale and bias), before filter and noise.
    fn rate_rad_s(&self) -> f64;
    /// Current reading of the current sensor, mean over the last `advance`, before noise.
    fn mean_current_A(&self) -> f64;
    /// Present supply voltage of the bridge.
    fn supply_V(&self) -> f64;
    /// Present winding temperature.
    fn temp_C(&self) -> f64;
    /// True angle.
    fn true_theta_rad(&self) -> f64;
    /// Sets the supply voltage; `None`: nominal. A plant may ignore this.
    fn set_supply(&mut self, _: Option<f64>) {}
    /// Sets the winding temperature. A plant may ignore this.
    fn set_winding_temperature(&mut self, _temp_C: f64) {}
    /// Sets the moment of inertia of a body on the platform, kg m²; 0: none. A plant may ignore this.
    fn set_load_inertia(&mut self, _added_kg_m2: f64) {}
    /// True rate; equal to [`PlantPort::rate_rad_s`] unless the sensor element errs.
    fn true_rate_rad_s(&self) -> f64 {
        self.rate_rad_s()
    }
}

/// True motion, for tests and reports.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Platform angle, rad.
    pub theta_rad: f64,
    /// Platform rate, rad/s.
    pub omega_rad_s: f64,
}

/// Plant, sensors and bridge of one stand at one time.
pub struct Bench {
    // Not a type parameter: the loop of the ticks is compiled once, here, and not in each crate that runs it.
    plant: Box<dyn PlantPort>,
    now: Ticks,
    /// Present time; the plant may lag by up to a tick.
    reached: Ticks,
    tick: u64,
    volt_per_duty: f64,
    acting_V: f64,
    pending_V: f64,
    /// Ticks since the last output of the interrupt.
    ticks_without_output: u32,
    /// Current times time since the start of the tick, A s, and that time, s.
    charge: (f64, f64),
    encoder: Encoder,
    edges: Edges,
    index: Index,
    /// Edge capture of the tasks.
    task_edge: TaskEdge,
    /// An emergency stop is requested by the line guard or a pin.
    stop: bool,
    /// Index captures of the interrupt's and the tasks' counter that have not been read.
    captured: [Option<Edge>; 2],
    current: CurrentAdc,
    rate: Stamped<RateSensor>,
    supply: Stamped<SlowChannel>,
    temperature: SlowChannel,
    imu: Option<Imu>,
    gyro: Option<GyroLine>,
    truth: [Truth; 2],
    /// Active faults, and the encoder counters under them: the interrupt's and the tasks'.
    broken: ActiveFaults,
    decoder: Decoder,
    /// Value of the interrupt's counter while it is stuck.
    stuck: Option<i64>,
    /// Time since which both encoder wires are disconnected.
    silent_since: Option<Ticks>,
    /// Current, A, and rate, rad/s, that a noise burst adds.
    burst: [Noise; 2],
    /// Time base of the controller: [`Ticks`] count its periods, the plant has true time.
    crystal: Crystal,
    reference: Option<ReferencePulses>,
    edge_timer_Hz: f64,
    /// Capture of the reference's last pulse that has not been read.
    captured_pulse: Option<EdgeTime>,
}

impl Bench {
    /// A bench at time 0, before its first tick.
    pub fn new(hardware: &Hardware, sensors: &SensorSetup, seed: u64, plant: Box<dyn PlantPort>) -> Self {
        let encoder = Encoder::new(hardware);
        let rate = RateSensor::new(hardware, sensors, seed, plant.rate_rad_s());
        let supply = SlowChannel::new(hardware.supply_V_per_code, Noise::new(seed, 2, sensors.supply_noise_V));
        let temperature = SlowChannel::new(hardware.temperature_C_per_code, Noise::new(seed, 3, sensors.temp_noise_K));
        Self {
            now: Ticks(0),
            reached: Ticks(0),
            tick: 0,
            volt_per_duty: hardware.volt_per_duty(),
            acting_V: 0.0,
            pending_V: 0.0,
            ticks_without_output: 0,
            charge: (0.0, 0.0),
            encoder,
            edges: Edges::new(encoder.exact(plant.theta_rad()), plant.true_rate_rad_s(), hardware),
            stop: false,
            index: Index::new(hardware, encoder.whole(plant.theta_rad())),
            task_edge: TaskEdge::new(hardware, encoder.exact(plant.theta_rad())),
            captured: [None; 2],
            current: CurrentAdc::new(hardware, sensors, seed),
            rate: Stamped { value: rate, at: Ticks(0) },
            supply: Stamped { value: supply, at: Ticks(0) },
            temperature,
            imu: None,
            gyro: None,
            truth: [Truth::default(); 2],
            broken: ActiveFaults::new(Faults::default()),
            decoder: Decoder::at(encoder.whole(plant.theta_rad())),
            stuck: None,
            silent_since: None,
            burst: [Noise::new(seed, 4, 1.0), Noise::new(seed, 5, 1.0)],
            crystal: Crystal::new(&ClockSetup::default()),
            reference: None,
            edge_timer_Hz: hardware.edge_timer_Hz,
            captured_pulse: None,
            plant,
        }
    }

    /// The bench of a stand: its sensors, its faults, and the sensor under test.
    pub fn of(stand: &StandSetup, seed: u64, plant: Box<dyn PlantPort>) -> Self {
        let bench = Self::new(&stand.hardware, &stand.sensors, seed, plant).with_faults(stand.faults).with_clock(&stand.clock, seed);
        match stand.imu {
            Some(sensor) => bench.with_imu(sensor, seed),
            None => bench,
        }
    }

    /// The same bench at this time, a whole millisecond, before its tick.
    pub fn starting_at(mut self, start: Ticks) -> Self {
        (self.now, self.reached, self.tick) = (start, start, start.0 / TICKS_PER_CONTROL);
        (self.rate.at, self.supply.at) = (start, start);
        self
    }

    /// The same bench with these faults.
    pub fn with_faults(self, faults: Faults) -> Self {
        Self { broken: ActiveFaults::new(faults), ..self }
    }

    /// The same bench with this crystal and reference; `seed` of the reference's phase and jitter.
    pub fn with_clock(self, clock: &ClockSetup, seed: u64) -> Self {
        let reference = clock.reference.map(|reference| ReferencePulses::new(&reference, seed));
        Self { crystal: Crystal::new(clock), reference, ..self }
    }

    /// Power-on: the counters start at 0 at any position of the disc, without a capture.
    pub fn power_on(&mut self) {
        self.decoder = Decoder::at(self.encoder.whole(self.plant.theta_rad()));
        self.captured = [None; 2];
        self.captured_pulse = None;
    }

    /// No output of the controller: from the next tick on no voltage is commanded.
    pub fn open_bridge(&mut self) {
        self.pending_V = 0.0;
    }

    /// The active faults; tests inject and clear faults here, in force from the next tick.
    pub fn active_faults(&mut self) -> &mut ActiveFaults {
        &mut self.broken
    }

    /// Advances everything to `to`; `interrupt` runs at the start of each tick up to and including `to`.
    #[inline]
    pub fn advance(&mut self, to: Ticks, mut interrupt: impl FnMut(&mut SimTickIo<'_>)) {
        while Ticks::of_control(self.tick) <= to {
            self.integrate(Ticks::of_control(self.tick));
            self.begin_tick();
            self.ticks_without_output = self.ticks_without_output.saturating_add(1);
            if !self.broken.any() || self.interrupt_comes() {
                interrupt(&mut SimTickIo(self));
            }
            if self.ticks_without_output >= OUTPUT_TIMEOUT_TICKS {
                self.pending_V = 0.0;
            }
            self.tick += 1;
        }
        self.reached = to;
    }

    /// Voltage of the bridge in the present tick, at nominal supply, V.
    pub fn acting_V(&self) -> f64 {
        self.acting_V
    }

    /// True motion at the last whole millisecond, and at the one before.
    pub fn truth(&self) -> [Truth; 2] {
        self.truth
    }

    /// Requests an emergency stop from the next tick on, or withdraws the request.
    pub fn request_stop(&mut self, stop: bool) {
        self.stop = stop;
    }

    /// The same bench with this sensor on its platform; `seed` of its noise.
    pub fn with_imu(self, sensor: ImuSetup, seed: u64) -> Self {
        Self { imu: Some(Imu::new(sensor, seed)), ..self }
    }

    /// The same bench with this gyroscope on torquer and angle sensor; `seed` of the converters' noise.
    pub fn with_gyro(self, gyro: Box<dyn GyroPort>, hardware: &Hardware, seed: u64) -> Self {
        Self { gyro: Some(GyroLine::new(gyro, hardware, seed)), ..self }
    }

    /// The gyroscope with its wires.
    pub fn gyro(&mut self) -> Option<&mut GyroLine> {
        self.gyro.as_mut()
    }

    /// The sensor under test.
    pub fn imu(&mut self) -> Option<&mut Imu> {
        self.imu.as_mut()
    }

    /// Chip select goes low at `now`; the device that responds until it goes high.
    fn select_sensor(&mut self, now: Ticks, mode: Mode) -> sensor_bus::Exchange<'_> {
        let mut chip = self.imu.as_mut().map(|imu| &mut imu.chip);
        if let Some(chip) = &mut chip {
            chip.select(self.crystal.true_s(now.seconds()));
        }
        sensor_bus::Exchange(chip, mode)
    }

    /// Advances the plant to the present time within a tick. Each call is an integration step, and few callers need it.
    fn catch_up(&mut self) {
        self.integrate(self.reached);
    }

    /// The plant.
    pub fn plant(&self) -> &dyn PlantPort {
        &*self.plant
    }

    /// The plant, to change it from outside.
    pub fn plant_mut(&mut self) -> &mut dyn PlantPort {
        &mut *self.plant
    }

    #[inline]
    fn integrate(&mut self, to: Ticks) {
        let steps = to - self.now;
        if steps == 0 {
            return;
        }
        let counted_s = steps as f64 * (1.0 / TICKS_PER_S as f64);
        let dt_s = self.crystal.true_s(counted_s);
        self.plant.advance(self.acting_V, dt_s);
        // The edge timer counts the crystal's periods.
        self.edges.advance(self.encoder.exact(self.plant.theta_rad()), self.plant.true_rate_rad_s(), counted_s);
        let disturbed = if self.broken.any() { self.rate_disturbance_rad_s() } else { 0.0 };
        self.rate.value.advance(self.plant.rate_rad_s() + disturbed, dt_s);
        if let Some(gyro) = &mut self.gyro {
            gyro.advance(self.plant.true_theta_rad(), dt_s);
        }
        if steps == TICKS_PER_CONTROL {
            // The usual case, without rounding.
            self.charge = (self.plant.mean_current_A(), 1.0);
        } else {
            self.charge.0 += self.plant.mean_current_A() * dt_s;
            self.charge.1 += dt_s;
        }
        self.now = to;
    }

    #[inline]
    fn begin_tick(&mut self) {
        if self.broken.begin(self.tick) {
            self.break_plant();
        }
        let (charge, time) = std::mem::take(&mut self.charge);
        if time > 0.0 && !self.broken.is_active(FaultKind::ConverterStopped) {
            let disturbed = if self.broken.any() { self.current_disturbance_A() } else { 0.0 };
            self.current.tick(charge / time + disturbed);
        }
        self.acting_V = self.pending_V;
        let exact = self.encoder.exact(self.plant.theta_rad());
        let disc = self.encoder.whole(self.plant.theta_rad());
        let shown =
            self.decoder.advance(disc, self.broken.is_active(FaultKind::EncoderAOff), self.broken.is_active(FaultKind::EncoderBOff));
        let passed = self.task_edge.pass(exact, disc, self.tick);
        if let Some(edge) = self.index.pass(disc, &passed).filter(|_| !self.broken.is_active(FaultKind::IndexOff)) {
            self.captured = [Some(counted(edge, shown - disc)); 2];
        }
        if self.tick.is_multiple_of(RATE_SENSOR_EVERY) && !self.broken.is_active(FaultKind::SensorSilent) {
            self.rate.value.sample();
            self.rate.at = self.now;
            if self.broken.is_active(FaultKind::SensorRubbish) {
                self.rate.value.random_full_scale();
            }
        }
        if let Some(gyro) = &mut self.gyro {
            gyro.tick(self.now);
        }
        if let Some(imu) = &mut self.imu {
            imu.tick(
                self.crystal.true_s(self.now.seconds()),
                self.plant.rate_rad_s(),
                self.plant.true_rate_rad_s(),
                self.plant.true_theta_rad(),
            );
        }
        if self.reference.is_some() {
            self.pass_reference();
        }
        if self.tick.is_multiple_of(CONTROL_PER_ROW) {
            if !self.broken.is_active(FaultKind::ConverterStopped) {
                self.supply.value.sample(self.plant.supply_V());
                self.supply.at = self.now;
            }
            self.temperature.sample(self.plant.temp_C());
            let now = Truth { theta_rad: self.plant.true_theta_rad(), omega_rad_s: self.plant.true_rate_rad_s() };
            self.truth = [now, self.truth[0]];
        }
    }
}

/// Faults, where they act. A stand without faults does not enter here.
impl Bench {
    /// Readings of the encoder counters, including wire faults.
    #[inline]
    fn counter_reading(&self) -> i64 {
        self.decoder.count(self.encoder.whole(self.plant.theta_rad()))
    }

    #[cold]
    fn interrupt_comes(&mut self) -> bool {
        if self.broken.is_active(FaultKind::WindingHot) {
            self.plant.set_winding_temperature(self.broken.magnitude(FaultKind::WindingHot));
        }
        if self.broken.is_active(FaultKind::PowerCut) {
            self.pending_V = 0.0;
        }
        !self.broken.is_active(FaultKind::LostTicks) && !self.broken.is_active(FaultKind::PowerCut)
    }

    /// Captures a pulse of the reference that came since the last tick.
    fn pass_reference(&mut self) {
        let now_s = self.crystal.true_s(self.now.seconds());
        let pulse_s = self.reference.as_mut().and_then(|reference| reference.pass(now_s));
        let pulse_s = pulse_s.filter(|_| !self.broken.is_active(FaultKind::ReferenceOff));
        let interference_s = self.broken.is_active(FaultKind::ReferenceInterference).then_some(now_s);
        if let Some(at_s) = interference_s.or(pulse_s) {
            self.captured_pulse = Some(EdgeTime((self.crystal.counted_s(at_s) * self.edge_timer_Hz) as u64));
        }
    }

    /// A fault has started or ended.
    #[cold]
    fn break_plant(&mut self) {
        let dips = self.broken.is_active(FaultKind::SupplyDip);
        self.plant.set_supply(dips.then(|| self.broken.magnitude(FaultKind::SupplyDip)));
        self.stuck = self.broken.is_active(FaultKind::CounterStuck).then(|| self.stuck.unwrap_or_else(|| self.counter_reading()));
        let limits = self.broken.is_active(FaultKind::TorquerLimit);
        let limit_A = limits.then(|| self.broken.magnitude(FaultKind::TorquerLimit));
        let unplugged = self.broken.is_active(FaultKind::AngleSensorOff);
        if let Some(line) = &mut self.gyro {
            line.disconnect(unplugged);
            line.gyro().limit(limit_A);
        }
        // With one wire disconnected edges come half as often and a stamp errs by one edge at most: not modelled.
        let silent = self.broken.is_active(FaultKind::EncoderAOff) && self.broken.is_active(FaultKind::EncoderBOff);
        self.silent_since = silent.then(|| self.silent_since.unwrap_or(self.now));
        if let Some(imu) = &mut self.imu {
            imu.chip.set_fault(match (self.broken.is_active(FaultKind::SensorSilent), self.broken.is_active(FaultKind::SensorRubbish)) {
                // The plug is disconnected: the line is pulled up.
                (true, _) => chip::Fault::Silent(0xFF),
                (_, true) => chip::Fault::FlippedBits(2),
                _ => chip::Fault::None,
            });
        }
    }

    #[cold]
    fn current_disturbance_A(&mut self) -> f64 {
        if self.broken.is_active(FaultKind::CurrentSensorOff) {
            return f64::NEG_INFINITY;
        }
        self.burst[0].draw() * self.broken.magnitude(FaultKind::NoiseBurst) * SensorSetup::default().current_noise_A
    }

    #[cold]
    fn rate_disturbance_rad_s(&mut self) -> f64 {
        self.burst[1].draw() * self.broken.magnitude(FaultKind::NoiseBurst) * SensorSetup::default().rate_noise_rad_s
    }
}

/// The edge in counts of a counter that differs from the disc.
fn counted(edge: Edge, ahead: i64) -> Edge {
    Edge { count: EncoderCount(edge.count.0.wrapping_add(ahead as u16)), ..edge }
}

/// Hardware of the interrupt.
pub struct SimTickIo<'a>(&'a mut Bench);

impl SimTickIo<'_> {
    /// Start time of this tick.
    pub fn now(&self) -> Ticks {
        self.0.now
    }

    /// Requests an emergency stop in this tick, or withdraws the request: from the line guard.
    pub fn request_stop(&mut self, stop: bool) {
        self.0.stop = stop;
    }
}

impl TickIo for SimTickIo<'_> {
    #[inline]
    fn sense(&mut self) -> Sensed {
        let bench = &self.0;
        Sensed {
            tick: bench.tick,
            encoder: EncoderCount(bench.stuck.unwrap_or_else(|| bench.counter_reading()) as u16),
            edge_age: match bench.silent_since {
                None => bench.edges.age(),
                Some(since) => bench.edges.age_after(bench.now - since),
            },
            current: bench.current.newest(),
            supply: SupplyCode(bench.supply.value.code().max(0) as u32),
            is_stale: bench.broken.is_active(FaultKind::ConverterStopped),
            stop: bench.stop,
            announced_stall: false,
        }
    }

    #[inline]
    fn index(&mut self) -> Option<EncoderCount> {
        self.0.captured[0].take().map(|edge| edge.count)
    }

    #[inline]
    fn drive(&mut self, out: Drive) {
        self.0.ticks_without_output = 0;
        self.0.pending_V = f64::from(out.counts()) * self.0.volt_per_duty;
    }
}

/// Hardware of the tasks.
pub struct SimBoard<'a> {
    bench: &'a RefCell<Bench>,
    clock: &'a VirtualClock,
    bus_taken: bool,
}

impl<'a> SimBoard<'a> {
    /// The hardware of the tasks on this bench and clock.
    pub fn new(bench: &'a RefCell<Bench>, clock: &'a VirtualClock) -> Self {
        Self { bench, clock, bus_taken: false }
    }
}

impl<'a> Board for SimBoard<'a> {
    type Clock = SimClock<'a>;
    type SensorBus = SensorBus<'a>;

    fn clock(&self) -> SimClock<'a> {
        SimClock(self.clock)
    }

    fn encoder(&mut self) -> Stamped<EncoderCount> {
        let mut bench = self.bench.borrow_mut();
        bench.catch_up();
        Stamped { value: EncoderCount(bench.counter_reading() as u16), at: bench.now }
    }

    fn edge(&mut self) -> Option<Edge> {
        let bench = self.bench.borrow();
        let disc = bench.encoder.whole(bench.plant.theta_rad());
        bench.task_edge.newest().map(|edge| counted(edge, bench.counter_reading() - disc))
    }

    fn index(&mut self) -> Option<Edge> {
        self.bench.borrow_mut().captured[1].take()
    }

    fn reference_pulse(&mut self) -> Option<EdgeTime> {
        self.bench.borrow_mut().captured_pulse.take()
    }

    fn current(&mut self) -> Stamped<CurrentSum> {
        let mut bench = self.bench.borrow_mut();
        bench.catch_up();
        Stamped { value: bench.current.take(), at: bench.now }
    }

    fn rate(&mut self) -> Option<Stamped<RateCode>> {
        let bench = self.bench.borrow();
        Some(Stamped { value: bench.rate.value.code(), at: bench.rate.at })
    }

    fn supply(&mut self) -> Option<Stamped<SupplyCode>> {
        let bench = self.bench.borrow();
        Some(Stamped { value: SupplyCode(bench.supply.value.code().max(0) as u32), at: bench.supply.at })
    }

    fn temperature(&mut self) -> Option<Stamped<TemperatureCode>> {
        let bench = self.bench.borrow();
        Some(Stamped { value: TemperatureCode(bench.temperature.code() as i32), at: bench.supply.at })
    }

    fn gyro(&mut self) -> Option<Stamped<GyroSample>> {
        self.bench.borrow().gyro.as_ref()?.newest()
    }

    fn roll(&mut self) -> Option<Stamped<RollCode>> {
        let mut bench = self.bench.borrow_mut();
        bench.catch_up();
        let at = bench.now;
        bench.gyro.as_ref()?.roll().map(|value| Stamped { value, at })
    }

    fn torque(&mut self, at: Ticks, step: TorquerStep) {
        if let Some(line) = &mut self.bench.borrow_mut().gyro {
            line.command(at, step);
        }
    }

    fn sensor_bus(&mut self) -> Option<SensorBus<'a>> {
        let first = !std::mem::replace(&mut self.bus_taken, true);
        first.then_some(SensorBus { bench: self.bench, clock: self.clock, mode: MODE_3 })
    }
}
