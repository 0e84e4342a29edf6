#![no_main]

use std::cell::RefCell;

use endowire_core::insertion::Simulation;
use endowire_tests::readers;

thread_local! {
    static SIMULATION: RefCell<Simulation> = RefCell::new(readers::simulation().expect("a simulation of its own"));
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    drop(SIMULATION.with_borrow_mut(|simulation| readers::state(simulation, bytes)));
});
