//! What work costs: time on a CPU, which other programs on a busy machine do not lengthen.
//!
//! Where the system counts no such time, the wall clock stands in.

use std::time::Duration;

/// A running stopwatch.
#[derive(Clone, Copy, Debug)]
pub struct CpuClock {
    of: Of,
    start: Duration,
}

#[derive(Clone, Copy, Debug)]
enum Of {
    Thread,
    Process,
}

impl CpuClock {
    /// Counts the time of the calling thread. It must be read on the same thread.
    #[must_use]
    pub fn thread() -> Self {
        Self { of: Of::Thread, start: now(Of::Thread) }
    }

    /// Counts the time of all threads of the process together, for steps that run on several and alone.
    #[must_use]
    pub fn process() -> Self {
        Self { of: Of::Process, start: now(Of::Process) }
    }

    /// Seconds of CPU time since the start.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        now(self.of).saturating_sub(self.start).as_secs_f64()
    }
}

#[cfg(unix)]
fn now(of: Of) -> Duration {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match of {
        Of::Thread => ClockId::ThreadCPUTime,
        Of::Process => ClockId::ProcessCPUTime,
    });
    // Both counts start at 0 and only grow.
    let [seconds, nanoseconds] = [time.tv_sec, time.tv_nsec].map(|part| u64::try_from(part).unwrap_or(0));
    Duration::from_secs(seconds) + Duration::from_nanos(nanoseconds)
}

#[cfg(not(unix))]
fn now(_: Of) -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeping_costs_nothing_and_working_does() {
        let clock = CpuClock::thread();
        std::thread::sleep(Duration::from_millis(200));
        assert!(cfg!(not(unix)) || clock.seconds() < 0.1, "{} s for a nap", clock.seconds());
        // Ends only once the clock has moved.
        let mut work = 0_u64;
        while clock.seconds() < 0.001 {
            work = std::hint::black_box(work + 1);
        }
    }
}
