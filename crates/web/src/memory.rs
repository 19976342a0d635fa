//! How a page and the module exchange text: three exported functions over buffers of the module's memory.
//!
//! The page asks for room, writes a request there, and asks for the answer. Nothing here reads or writes
//! through a pointer: buffers are the module's own, and the page sees its memory as bytes. What the lint
//! calls unsafe are only the names of the exports, which have to be the only ones of their kind.
#![allow(unsafe_code)]

use crate::operations;
use std::sync::{Mutex, MutexGuard};

/// The longest request, in bytes: more than a page ever asks.
const LONGEST: usize = 1 << 28;

struct Exchange {
    request: Vec<u8>,
    reply: Vec<u8>,
}

static EXCHANGE: Mutex<Exchange> = Mutex::new(Exchange { request: Vec::new(), reply: Vec::new() });

fn exchange() -> MutexGuard<'static, Exchange> {
    EXCHANGE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Where a request of so many bytes goes; null where it is too long. Holds until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    if length > LONGEST {
        return std::ptr::null_mut();
    }
    let mut exchange = exchange();
    exchange.request = vec![0; length];
    exchange.request.as_mut_ptr()
}

/// Answers the request of so many bytes; where the reply begins. Holds until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn answer(length: usize) -> *const u8 {
    let mut exchange = exchange();
    let mut request = std::mem::take(&mut exchange.request);
    request.truncate(length);
    exchange.reply = Vec::new();
    exchange.reply = operations::answer(&request);
    exchange.reply.as_ptr()
}

/// How many bytes the reply has.
#[unsafe(no_mangle)]
pub extern "C" fn reply_length() -> usize {
    exchange().reply.len()
}
