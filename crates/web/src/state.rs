//! What a page has asked to be kept: machines and runs, by their numbers.

use crate::bundle::Bundle;
use crate::given::Given;
use crate::reply::{Answer, fault};
use crate::run::Run;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Machines and runs.
#[derive(Default)]
pub struct State {
    last: u64,
    machines: BTreeMap<u64, Rc<Bundle>>,
    runs: BTreeMap<u64, Run>,
}

impl State {
    /// Keeps a machine; its number.
    pub fn keep(&mut self, bundle: Bundle) -> u64 {
        self.last += 1;
        self.machines.insert(self.last, Rc::new(bundle));
        self.last
    }

    /// Keeps a run; its number.
    pub fn keep_run(&mut self, run: Run) -> u64 {
        self.last += 1;
        self.runs.insert(self.last, run);
        self.last
    }

    /// The machine that a request names.
    pub fn machine(&self, request: &Given<'_>) -> Answer<Rc<Bundle>> {
        let number = request.item("machine")?;
        match self.machines.get(&number.whole()?) {
            Some(bundle) => Ok(Rc::clone(bundle)),
            None => fault("unknown-machine", number.place, "there is no such machine"),
        }
    }

    /// The run that a request names.
    pub fn run(&mut self, request: &Given<'_>) -> Answer<&mut Run> {
        let number = request.item("run")?;
        match self.runs.get_mut(&number.whole()?) {
            Some(run) => Ok(run),
            None => fault("unknown-run", number.place, "there is no such run"),
        }
    }

    /// Forgets the machine or the run that a request names.
    pub fn free(&mut self, request: &Given<'_>) -> Answer<()> {
        if request.get("run").is_some() {
            self.run(request)?;
            self.runs.remove(&request.item("run")?.whole()?);
        } else {
            self.machine(request)?;
            self.machines.remove(&request.item("machine")?.whole()?);
        }
        Ok(())
    }
}
