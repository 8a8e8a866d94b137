//! stub
#![no_std]
#![no_main]
use {defmt_rtt as _, panic_probe as _};
use embassy_executor::Spawner;
#[embassy_executor::main]
async fn main(_s: Spawner) { let _p = embassy_stm32::init(Default::default()); loop { cortex_m::asm::wfi() } }
