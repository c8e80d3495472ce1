//! A scene that runs while it is looked at: one thread manages it, one makes paths of pointers, others do long jobs.

use crate::pointers::Pointers;
use crate::stage::{PageNotifier, SceneProvider, Upload, ViewerDevice, ViewerScene};
use crate::wire::{
    Answer, FrameEncoder, FrameFormat, MaterialDescription, PhysicsSettings, ProcessTiming, Status,
};
use axum::body::Bytes;
use palpate::{Input, Model, ObjectSnapshot, State};
use palpate_haptics::{
    Clock, CycleReceiver, ObstacleTrajectory, Playback, Report, Scheduling, Session, SessionDevice, Snapshot,
    Timing, cycles, port,
};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};
use tokio::sync::{broadcast, watch};

/// Pictures per second.
const PICTURES_HZ: f64 = 60.0;

/// Between two tellings of how the force process keeps its time.
const STATUS_EVERY: Duration = Duration::from_millis(500);

/// Hands of pointers are moved so often [Hz].
const POINTERS_HZ: f64 = 1000.0;

/// A device that has told nothing for so long [s] is away.
const PATIENCE_S: f64 = 0.1;

/// Cycles that wait to be counted: those of some seconds at 4 kHz.
const CYCLES: usize = 16_384;

/// Texts for pages that may wait.
const EVENTS: usize = 256;

/// What the stage's manager is asked for.
pub(crate) enum Command {
    Open(String),
    Reset,
    PhysicsSettings(PhysicsSettings),
    Material(usize, MaterialDescription),
    /// From whoever has claimed the job.
    Record(Upload),
    /// What a job has made.
    Made(Result<Box<ViewerScene>, String>),
    /// There is a new viewer: tell how things are.
    ProgressCallback,
    End,
}

/// A scene as pages get it.
pub(crate) struct Shown {
    pub generation: u32,
    pub stage: ViewerScene,
    /// Its `scene` message.
    pub message: Arc<str>,
}

/// What pages see of a scene that runs, and how they act on it.
pub(crate) struct Live {
    pub shown: watch::Receiver<Arc<Shown>>,
    pub modal: watch::Receiver<Bytes>,
    pub vertices: watch::Receiver<Bytes>,
    pub events: broadcast::Sender<Arc<str>>,
    pub commands: Sender<Command>,
    pub pointers: Arc<Mutex<Pointers>>,
    pub playback: Arc<Playback>,
    pub viewers: Arc<Viewers>,
    /// Whether a job is under way.
    busy: Arc<AtomicBool>,
    manager: Mutex<Option<JoinHandle<()>>>,
}

/// Who looks on.
#[derive(Debug, Default)]
pub(crate) struct Viewers {
    pub all: AtomicUsize,
    /// Those who want whole surfaces.
    pub vertices: AtomicUsize,
}

/// What is said when another job is under way.
pub(crate) const BUSY: &str = "a recording is under way: ask again when it is done";

fn claim(busy: &AtomicBool) -> bool {
    !busy.swap(true, Ordering::AcqRel)
}

/// Whatever a thread did while it held the lock, pointers are still pointers.
pub(crate) fn lock(pointers: &Mutex<Pointers>) -> MutexGuard<'_, Pointers> {
    pointers.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where pictures go.
#[derive(Clone)]
struct Screens {
    modal: watch::Sender<Bytes>,
    vertices: watch::Sender<Bytes>,
    viewers: Arc<Viewers>,
}

impl Screens {
    fn show(&self, maker: &mut FrameEncoder, moment: &Snapshot) {
        if self.viewers.all.load(Ordering::Relaxed) > 0 {
            self.modal.send_replace(maker.make(moment, FrameFormat::Modal).into());
        }
        if self.viewers.vertices.load(Ordering::Relaxed) > 0 {
            self.vertices.send_replace(maker.make(moment, FrameFormat::Vertices).into());
        }
    }

    /// So that whoever comes has a picture.
    fn show_all(&self, maker: &mut FrameEncoder, moment: &Snapshot) {
        self.modal.send_replace(maker.make(moment, FrameFormat::Modal).into());
        self.vertices.send_replace(maker.make(moment, FrameFormat::Vertices).into());
    }
}

impl Live {
    /// Run a scene that a workshop made.
    ///
    /// # Errors
    /// When a thread can't be started.
    pub fn new(
        workshop: Arc<dyn SceneProvider>,
        first: ViewerScene,
        scheduling: Scheduling,
    ) -> std::io::Result<Self> {
        let (commands, asked) = channel();
        let (modal_in, modal) = watch::channel(Bytes::new());
        let (vertices_in, vertices) = watch::channel(Bytes::new());
        let (events, _) = broadcast::channel(EVENTS);
        let viewers = Arc::new(Viewers::default());
        let pointers: Arc<Mutex<Pointers>> = Arc::default();
        let playback: Arc<Playback> = Arc::default();
        let busy: Arc<AtomicBool> = Arc::default();
        let (shown_in, shown) = watch::channel(Arc::new(Shown::new(0, first.clone())));
        let mut manager = Manager {
            workshop,
            scheduling,
            shown: shown_in,
            screens: Screens { modal: modal_in, vertices: vertices_in, viewers: viewers.clone() },
            events: events.clone(),
            commands: commands.clone(),
            pointers: pointers.clone(),
            playback: playback.clone(),
            running: None,
            busy: busy.clone(),
        };
        // Before anybody can ask: the first page is told of what is shown.
        manager.show(first, None);
        let manager = Builder::new().name("palpate stage".into()).spawn(move || manager.run(&asked))?;
        let manager = Mutex::new(Some(manager));
        Ok(Self { shown, modal, vertices, events, commands, pointers, playback, viewers, busy, manager })
    }

    /// Claim the one long job that there can be at a time; says whether it was free.
    pub fn claim(&self) -> bool {
        claim(&self.busy)
    }

    /// End what runs. When this is back its log is whole.
    pub fn end(&self) {
        let _ = self.commands.send(Command::End);
        let manager = self.manager.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(manager) = manager {
            let _ = manager.join();
        }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.end();
    }
}

impl Shown {
    fn new(generation: u32, stage: ViewerScene) -> Self {
        let message = Answer::Scene { generation, scene: &stage.description }.text().into();
        Self { generation, stage, message }
    }
}

/// The session that runs now.
struct Running {
    stop: Arc<AtomicBool>,
    steps: Arc<AtomicU64>,
    thread: JoinHandle<Option<Vec<ObjectSnapshot>>>,
    pointing: JoinHandle<()>,
    timing: Timing,
    listener: CycleReceiver,
}

struct Manager {
    workshop: Arc<dyn SceneProvider>,
    scheduling: Scheduling,
    shown: watch::Sender<Arc<Shown>>,
    screens: Screens,
    events: broadcast::Sender<Arc<str>>,
    commands: Sender<Command>,
    pointers: Arc<Mutex<Pointers>>,
    playback: Arc<Playback>,
    running: Option<Running>,
    busy: Arc<AtomicBool>,
}

impl Manager {
    fn run(&mut self, asked: &Receiver<Command>) {
        let mut status_at = Instant::now();
        loop {
            match asked.recv_timeout(status_at.saturating_duration_since(Instant::now())) {
                Ok(Command::End) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(command) => self.obey(command),
                Err(RecvTimeoutError::Timeout) => {
                    status_at = Instant::now() + STATUS_EVERY;
                    self.tell_status();
                }
            }
        }
        self.stop();
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Open(_) | Command::Material(..) if !claim(&self.busy) => {
                self.say(&Answer::Error { text: BUSY });
            }
            Command::Open(id) => self.begin_job("scene", move |workshop, tell| workshop.open(&id, tell)),
            Command::Material(object, material) => self.begin_job("material", move |workshop, tell| {
                workshop.change_material(object, material, tell)
            }),
            Command::Record(upload) => {
                self.begin_job("mesh", move |workshop, tell| workshop.record(upload, tell));
            }
            Command::PhysicsSettings(rules) => {
                if self.busy.load(Ordering::Acquire) {
                    self.say(&Answer::Error {
                        text: "a recording is under way: change this when it is done",
                    });
                    return;
                }
                match self.workshop.change(&rules) {
                    Ok(stage) => {
                        let from = self.stop().filter(|_| stage.goes_on());
                        self.show(stage, from);
                    }
                    Err(text) => self.say(&Answer::Error { text: &text }),
                }
            }
            Command::Reset => {
                self.stop();
                let stage = self.shown.borrow().stage.clone();
                self.show(stage, None);
            }
            Command::Made(made) => {
                self.busy.store(false, Ordering::Release);
                match made {
                    Ok(stage) => {
                        self.stop();
                        self.show(*stage, None);
                    }
                    Err(text) => self.say(&Answer::Error { text: &text }),
                }
            }
            Command::ProgressCallback => self.tell_status(),
            Command::End => {}
        }
    }

    /// Do what may take long, and was claimed, on a thread of its own; the scene goes on meanwhile.
    fn begin_job(
        &mut self,
        job: &'static str,
        make: impl FnOnce(&dyn SceneProvider, crate::stage::ProgressCallback) -> Result<ViewerScene, String>
        + Send
        + 'static,
    ) {
        let (workshop, events, commands) =
            (self.workshop.clone(), self.events.clone(), self.commands.clone());
        let work = move || {
            let progress = |what: &str, share: Option<f64>, done: bool| {
                let _ = events.send(Answer::Progress { job, what, share, done }.text().into());
            };
            let made = make(&*workshop, &mut |what, share| progress(what, share, false));
            progress("", Some(1.0), true);
            let _ = commands.send(Command::Made(made.map(Box::new)));
        };
        if let Err(error) = Builder::new().name(format!("palpate {job}")).spawn(work) {
            self.busy.store(false, Ordering::Release);
            self.say(&Answer::Error { text: &format!("cannot start a thread: {error}") });
        }
    }

    fn say(&self, answer: &Answer) {
        let _ = self.events.send(answer.text().into());
    }

    fn page_teller(&self) -> PageNotifier {
        let events = self.events.clone();
        Arc::new(move |text| drop(events.send(Answer::Error { text }.text().into())))
    }

    /// End what runs; gives how its objects moved.
    fn stop(&mut self) -> Option<Vec<ObjectSnapshot>> {
        let Running { stop, thread, pointing, .. } = self.running.take()?;
        stop.store(true, Ordering::Release);
        let motions = thread.join().ok().flatten();
        let _ = pointing.join();
        *lock(&self.pointers) = Pointers::default();
        motions
    }

    /// Run a scene, from its start or from where another has ended.
    fn show(&mut self, stage: ViewerScene, from: Option<Vec<ObjectSnapshot>>) {
        let generation = self.shown.borrow().generation + 1;
        let state = from.map_or_else(|| State::new(&stage.model), |from| State::resume(&stage.model, &from));
        let mut maker = FrameEncoder::new(stage.model.clone(), generation);
        self.shown.send_replace(Arc::new(Shown::new(generation, stage.clone())));
        self.say_scene();
        match self.start(&stage, state, &mut maker, generation) {
            Ok(running) => self.running = Some(running),
            Err(text) => self.say(&Answer::Error { text: &text }),
        }
    }

    fn say_scene(&self) {
        let message = self.shown.borrow().message.clone();
        let _ = self.events.send(message);
    }

    fn start(
        &self,
        stage: &ViewerScene,
        state: State,
        maker: &mut FrameEncoder,
        generation: u32,
    ) -> Result<Running, String> {
        let model = stage.model.clone();
        self.screens.show_all(maker, &first_moment(&model, &state, stage));
        let mut ports = Vec::new();
        let seat = |(at, device): (usize, &ViewerDevice)| match device {
            ViewerDevice::Pointer => {
                let (device_port, force_port) = port();
                ports.push((at, device_port));
                Ok(SessionDevice::Linked(force_port, palpate::DeviceMode::Touch))
            }
            ViewerDevice::Following(path, mode) => Ok(SessionDevice::Following(path.clone(), *mode)),
            ViewerDevice::Here(open) => open().map(SessionDevice::Here),
        };
        let devices: Result<Vec<_>, String> = stage.devices.iter().enumerate().map(seat).collect();
        let movers = stage.movers.iter().map(|mover| {
            let mover = mover.clone();
            Box::new(move |t: f64| mover(t)) as ObstacleTrajectory
        });
        let log = stage.log.as_ref().map(|open| open(&state, self.page_teller()));
        let log = log.and_then(|log| {
            log.map_err(|text| self.say(&Answer::Error { text: &format!("there is no log: {text}") })).ok()
        });
        let (teller, listener) = cycles(CYCLES);
        let start = Instant::now();
        let session = Session {
            model: model.clone(),
            state: Some(state),
            start,
            devices: devices?,
            movers: movers.collect(),
            steps: None,
            pictures_hz: PICTURES_HZ,
            scheduling: self.scheduling,
            patience_s: PATIENCE_S,
            playback: self.playback.clone(),
            cycles: Some(teller),
        };
        *lock(&self.pointers) = Pointers::new(ports);
        let stop = Arc::new(AtomicBool::new(false));
        let steps = Arc::new(AtomicU64::new(0));
        let pointing = {
            let (stop, pointers) = (stop.clone(), self.pointers.clone());
            let clock = Clock::new(start, 1.0 / POINTERS_HZ).asleep();
            let point = move || move_pointers(&stop, &pointers, &clock);
            Builder::new().name("palpate pointers".into()).spawn(point).map_err(|e| e.to_string())?
        };
        let (screens, events) = (self.screens.clone(), self.events.clone());
        let (stopped, counted) = (stop.clone(), steps.clone());
        let mut maker = FrameEncoder::new(model, generation);
        let force = move || {
            let show = |moment: &Snapshot| screens.show(&mut maker, moment);
            match session.run(log, &stopped, &counted, show) {
                Ok((Report { state, log, .. }, out)) => {
                    // What could not be written has been told by who opened it.
                    if let (Some(Ok(file)), Some(summary)) = (out, log) {
                        file.finish(summary);
                    }
                    Some(state.snapshots())
                }
                Err(error) => {
                    let _ = events.send(Answer::Error { text: &error.to_string() }.text().into());
                    None
                }
            }
        };
        let thread = Builder::new().name("palpate session".into()).spawn(force).map_err(|e| e.to_string())?;
        Ok(Running { stop, steps, thread, pointing, timing: Timing::default(), listener })
    }

    fn tell_status(&mut self) {
        let generation = self.shown.borrow().generation;
        let Some(Running { timing, listener, steps, .. }) = &mut self.running else { return };
        listener.listen(timing);
        let status = Status {
            generation,
            paused: self.playback.is_paused(),
            slowness: self.playback.slowness(),
            steps: steps.load(Ordering::Relaxed),
            viewers: self.screens.viewers.all.load(Ordering::Relaxed),
            force_process: ProcessTiming {
                compute_us: timing.compute_us().into(),
                late_us: timing.lateness_us().into(),
                overruns: timing.overruns,
                own_overruns: timing.own_overruns,
                priority: listener.granted().is_some_and(|got| matches!(got.priority, Ok(Some(_)))),
            },
        };
        self.say(&Answer::Status(status));
    }
}

impl ViewerScene {
    /// Whether it makes sense to go on under other rules: where nothing follows a path from the start.
    fn goes_on(&self) -> bool {
        let follows = |device: &ViewerDevice| matches!(device, ViewerDevice::Following(..));
        let moves = |mover: &crate::SharedTrajectory| mover(0.0) != mover(1.0) || mover(0.0) != mover(0.37);
        !self.devices.iter().any(follows) && !self.movers.iter().any(moves)
    }
}

/// The scene before its first step.
fn first_moment(model: &Arc<Model>, state: &State, stage: &ViewerScene) -> Snapshot {
    let input = Input {
        devices: vec![palpate::DeviceInput::inactive(); stage.devices.len()],
        obstacles: stage.movers.iter().map(|mover| mover(0.0)).collect(),
    };
    Snapshot::new(model, state, &input)
}

fn move_pointers(stop: &AtomicBool, pointers: &Mutex<Pointers>, clock: &Clock) {
    let mut tick = clock.next_after(0);
    let mut last = clock.now_s();
    while !stop.load(Ordering::Relaxed) {
        clock.wait(tick);
        let now = clock.now_s();
        lock(pointers).advance(now - last, now);
        last = now;
        tick = clock.next_after(tick);
    }
}
