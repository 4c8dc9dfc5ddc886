//! What makes a thread punctual, as far as the system permits.

use rustix::mm::{MlockAllFlags, mlockall};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// What was permitted; each with the reason if not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RealTime {
    /// `SCHED_FIFO` with this priority.
    pub scheduling: Result<u8, String>,
    /// The process's memory stays in.
    pub memory: Result<(), String>,
}

impl RealTime {
    pub(super) fn not_asked_for() -> Self {
        let reason = "not asked for".to_owned();
        Self {
            scheduling: Err(reason.clone()),
            memory: Err(reason),
        }
    }

    /// For people: what is missing, and how to permit it; none when nothing is.
    pub fn complaint(&self) -> Option<String> {
        let mut missing = Vec::new();
        if let Err(reason) = &self.scheduling {
            missing.push(format!("no real-time scheduling ({reason})"));
        }
        if let Err(reason) = &self.memory {
            missing.push(format!("memory is not locked ({reason})"));
        }
        (!missing.is_empty()).then(|| {
            format!(
                "{}; to permit both: `@realtime - rtprio 80` and `@realtime - memlock unlimited` in \
                 /etc/security/limits.d, or capabilities CAP_SYS_NICE and CAP_IPC_LOCK",
                missing.join(", ")
            )
        })
    }
}

/// For the calling thread; 0 asks for nothing.
pub(super) fn become_punctual(priority: u8) -> RealTime {
    if priority == 0 {
        return RealTime::not_asked_for();
    }
    RealTime {
        scheduling: schedule(priority),
        // Pages are locked as they are used: stacks of other threads do not fill the memory.
        memory: mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT)
            .map_err(|error| error.to_string()),
    }
}

fn schedule(priority: u8) -> Result<u8, String> {
    let value = ThreadPriorityValue::try_from(priority)?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy)
        .map(|()| priority)
        .map_err(|error| format!("{error:?}"))
}
