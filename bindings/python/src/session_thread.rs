//! Threads of a session: started, watched and stopped without the interpreter's lock.

use crate::errors::{Class, catch_panic, exception, internal_error};
use palpate::{Input, State};
use palpate_haptics::log::{LogSender, LogWriter};
use palpate_haptics::{
    CycleReceiver, Error, Playback, Report, Session, Snapshot, SnapshotReader, Timing, cycle_channel,
    snapshot_buffer,
};
use palpate_scene::{GrowingLog, Scene, SceneError};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::Builder;
use std::time::Duration;

/// Log of a session, begun.
pub type SessionLog = (LogSender, LogWriter<GrowingLog>);

/// Capacity of the channel of cycle records: some seconds at 4 kHz, and it is emptied with every picture.
const CYCLES: usize = 16_384;

/// Sessions of this process, which end in good order with the interpreter.
static SESSIONS: Mutex<Vec<Weak<Running>>> = Mutex::new(Vec::new());

/// Session whose threads run, or have ended.
pub struct Running {
    /// Process that has the threads: a forked one does not.
    process: u32,
    stop: AtomicBool,
    steps: AtomicU64,
    pub playback: Arc<Playback>,
    newest: Mutex<SnapshotReader>,
    cycles: Mutex<(CycleReceiver, Timing)>,
    /// Step that could not be followed.
    pub lost_step: Arc<LostStep>,
    end: Mutex<Option<Arc<End>>>,
    ended: Condvar,
}

/// End of a session.
pub struct End {
    pub report: Result<Report, SessionFailure>,
    /// Whether the log, if there is one, is whole.
    pub log: Result<(), SceneError>,
}

/// Reason that a session failed.
pub enum SessionFailure {
    Error(Error),
    Panic(String),
}

impl SessionFailure {
    /// Exception.
    pub fn exception(&self, py: Python<'_>) -> PyErr {
        match self {
            Self::Panic(text) => internal_error(py, text),
            Self::Error(error @ Error::ThreadPanic { .. }) => internal_error(py, &error.to_string()),
            Self::Error(error @ Error::Session(_)) => exception(py, Class::Scene, error),
            Self::Error(error) => exception(py, Class::Palpate, error),
        }
    }
}

/// Text about a step that could not be followed, until the caller is told.
#[derive(Default)]
pub struct LostStep {
    is_lost: AtomicBool,
    text: Mutex<Option<String>>,
}

impl LostStep {
    /// Check a step, but while the caller has not been told of an earlier one.
    ///
    /// # Real time
    /// No allocation, lock or system call where the step was followed.
    fn check(&self, scene: &Scene, input: &Input, state: &State) {
        if self.is_lost.load(Ordering::Acquire) {
            return;
        }
        if let Err(text) = scene.check_step(input, state) {
            *lock(&self.text) = Some(text);
            self.is_lost.store(true, Ordering::Release);
        }
    }

    /// Text, once.
    pub fn take(&self) -> Option<String> {
        if !self.is_lost.load(Ordering::Acquire) {
            return None;
        }
        let text = lock(&self.text).take();
        self.is_lost.store(false, Ordering::Release);
        text
    }
}

/// Guard of a mutex; what a panic left is whole, since nothing is written in parts.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Running {
    /// Start a session at a state, whose first snapshot is given.
    pub fn start(
        session: Session,
        scene: &Arc<Scene>,
        state: State,
        first: &Snapshot,
        log: Option<SessionLog>,
    ) -> Result<Arc<Self>, SessionFailure> {
        session.check().map_err(SessionFailure::Error)?;
        let (mut writer, newest) = snapshot_buffer(first);
        let (cycle_sender, cycle_receiver) = cycle_channel(CYCLES);
        let running = Arc::new(Self {
            process: std::process::id(),
            stop: AtomicBool::new(false),
            steps: AtomicU64::new(0),
            playback: session.playback.clone(),
            newest: Mutex::new(newest),
            cycles: Mutex::new((cycle_receiver, Timing::default())),
            lost_step: Arc::default(),
            end: Mutex::new(None),
            ended: Condvar::new(),
        });
        let (scene, lost_step) = (Arc::clone(scene), Arc::clone(&running.lost_step));
        let session = Session {
            state: Some(state),
            cycles: Some(cycle_sender),
            listener: Some(Box::new(move |input, state| {
                writer.publish(state.step_count(), input, state);
                lost_step.check(&scene, input, state);
            })),
            ..session
        };
        let own = Arc::clone(&running);
        let spawned = Builder::new().name("palpate session".into()).spawn(move || own.run(session, log));
        spawned.map_err(|error| {
            let (purpose, reason) = ("session".to_string(), error.to_string());
            SessionFailure::Error(Error::ThreadSpawn { purpose, reason })
        })?;
        let mut sessions = lock(&SESSIONS);
        sessions.retain(|own| own.strong_count() > 0);
        sessions.push(Arc::downgrade(&running));
        Ok(running)
    }

    fn run(&self, session: Session, log: Option<SessionLog>) {
        let drain = |_: &Snapshot| {
            if let Ok(mut cycles) = self.cycles.try_lock() {
                let (receiver, timing) = &mut *cycles;
                receiver.drain_into(timing);
            }
        };
        let ran = catch_panic(|| session.run(log, &self.stop, &self.steps, drain));
        let end = match ran {
            Err(text) => End { report: Err(SessionFailure::Panic(text)), log: Ok(()) },
            Ok(Err(error)) => End { report: Err(SessionFailure::Error(error)), log: Ok(()) },
            Ok(Ok((report, written))) => {
                let kept = written.zip(report.log).map_or(Ok(()), |(log, summary)| log.sink.keep(summary));
                End { report: Ok(report), log: kept }
            }
        };
        *lock(&self.end) = Some(Arc::new(end));
        self.ended.notify_all();
    }

    /// Whether this process has the threads; another that was forked from it has none of them.
    pub fn is_here(&self) -> bool {
        self.process == std::process::id()
    }

    /// Ask the threads to end.
    pub fn ask_to_stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    /// End; none while the threads run.
    pub fn end(&self) -> Option<Arc<End>> {
        lock(&self.end).clone()
    }

    /// Wait for the end, at most for a time.
    pub fn wait(&self, patience: Duration) -> Option<Arc<End>> {
        let end = lock(&self.end);
        let waited = self.ended.wait_timeout_while(end, patience, |end| end.is_none());
        waited.unwrap_or_else(PoisonError::into_inner).0.clone()
    }

    /// Wait for the end, however long it takes.
    pub fn join(&self) -> Arc<End> {
        loop {
            if let Some(end) = self.wait(Duration::from_secs(3600)) {
                return end;
            }
        }
    }

    /// Number of steps.
    pub fn steps(&self) -> u64 {
        self.steps.load(Ordering::Relaxed)
    }

    /// Copy of the newest snapshot.
    pub fn newest(&self) -> Snapshot {
        lock(&self.newest).latest().clone()
    }

    /// Timing of the force process so far, and the scheduling that it was granted.
    pub fn timing(&self) -> (Timing, Option<String>) {
        if let Some(Ok(report)) = self.end().as_deref().map(|end| &end.report) {
            return (report.force.clone(), Some(report.granted.to_string()));
        }
        let mut cycles = lock(&self.cycles);
        let (receiver, timing) = &mut *cycles;
        receiver.drain_into(timing);
        (timing.clone(), receiver.granted().map(ToString::to_string))
    }
}

/// End all sessions of this process: when the interpreter ends, logs become whole.
#[pyfunction]
pub fn stop_sessions(py: Python<'_>) {
    let sessions: Vec<_> = lock(&SESSIONS).drain(..).filter_map(|own| own.upgrade()).collect();
    let here: Vec<_> = sessions.into_iter().filter(|own| own.is_here()).collect();
    here.iter().for_each(|own| own.ask_to_stop());
    py.detach(|| {
        here.iter().for_each(|own| {
            own.join();
        });
    });
}
