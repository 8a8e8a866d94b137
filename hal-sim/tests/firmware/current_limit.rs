//! The current limit at other supplies and winding temperatures than the nominal ones, and its distance from the trip.
#![allow(clippy::unwrap_used)]

use hal_sim::board::{Bench, PlantPort};
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::Ticks;
use stand_firmware::speed_loop::{Command, Config, Fault, Interrupt, Mailboxes, Segment, SpeedLoop};

/// Relative change of copper's resistance per kelvin.
const COPPER_1_K: f64 = 3.9e-3;

/// Drives from rest at 6 V for 0.15 s, then at −6 V: greatest current, and mean current from 50 ms to 100 ms, A; the fault.
fn reversal(stand: &Stand, supply_V: f64) -> (f64, f64, Fault) {
    let mailboxes = Mailboxes::new();
    let mut interrupt = Interrupt::new(SpeedLoop::new(Config::new(&stand.firmware, &stand.hardware).unwrap()), &mailboxes);
    let mut plant = Plant::new(stand, 0.0).unwrap();
    plant.set_supply(Some(supply_V));
    let mut bench = Bench::new(&stand.hardware, &stand.sensors, 1, Box::new(plant));
    let (mut greatest_A, mut sum_A, mut count) = (0.0_f64, 0.0, 0);
    for tick in 0..2600_u64 {
        let volts = if tick < 1600 { 6.0 } else { -6.0 };
        if tick == 100 || tick == 1600 {
            mailboxes.commands.post(Command { segment: Segment::voltage(&stand.hardware, tick, u16::MAX, volts), ..Command::default() });
        }
        bench.advance(Ticks::of_control(tick), |io| interrupt.run(io));
        let current_A = bench.plant().mean_current_A();
        greatest_A = greatest_A.max(current_A.abs());
        if (600..1100).contains(&tick) {
            sum_A += current_A;
            count += 1;
        }
    }
    (greatest_A, sum_A / f64::from(count), mailboxes.reports.take().unwrap().fault)
}

#[test]
fn limit_holds_at_any_supply_and_winding_temperature_with_a_fifth_to_the_trip() {
    let settings = Stand::default().firmware;
    println!("| supply, V | winding, °C | held, A | greatest, A |\n|---|---|---|---|");
    for supply_V in [9.5, 12.0, 14.4] {
        for temperature_C in [-10.0, 25.0, 120.0] {
            let mut stand = Stand::default();
            stand.drive.resistance_ohm *= 1.0 + COPPER_1_K * (temperature_C - 25.0);
            let (greatest_A, held_A, fault) = reversal(&stand, supply_V);
            println!("| {supply_V} | {temperature_C} | {held_A:.3} | {greatest_A:.3} |");
            assert_eq!(fault, Fault::None, "{supply_V} V, {temperature_C} °C: {greatest_A} A");
            // A hot winding is found within some 20 ms.
            assert!((held_A / settings.current_limit_A - 1.0).abs() < 0.03, "{supply_V} V, {temperature_C} °C: {held_A} A");
        }
    }
    assert!(settings.safety.over_current_A >= 1.2 * settings.current_limit_A);
}
