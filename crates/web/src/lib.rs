//! `truepose-web`: the kernel in a page. A request and its reply are JSON; every request is checked, and
//! none of them traps.
//!
//! A bundle (`truepose.live`) says what a machine is and, as laws, what is known and unknown of it. The
//! laws are evaluated here; everything else is the kernel's.

mod base64;
mod bundle;
mod climb;
mod condition;
mod dead_zones;
mod deflection;
mod ellipse;
mod given;
mod laws;
mod memory;
mod operations;
mod placed;
mod reply;
mod run;
mod shifts;
mod state;
mod weight;
