//! Place of the one job that runs at a time.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Place of a job.
#[derive(Debug, Default)]
pub(crate) struct JobSlot(Mutex<Option<Arc<Job>>>);

/// Job, from its upload to its end.
#[derive(Debug)]
struct Job {
    /// Viewer that asked for it; it is cancelled when that leaves.
    owner: Option<u64>,
    cancelled: AtomicBool,
    cancellation: Notify,
}

/// Right to run a job; gives the place back when dropped.
#[derive(Debug)]
pub(crate) struct JobPermit {
    slot: Arc<JobSlot>,
    job: Arc<Job>,
}

impl JobSlot {
    /// Takes the place for a viewer; `None` if it is taken.
    pub fn claim(self: &Arc<Self>, owner: Option<u64>) -> Option<JobPermit> {
        let mut place = self.lock();
        if place.is_some() {
            return None;
        }
        let job = Arc::new(Job { owner, cancelled: AtomicBool::new(false), cancellation: Notify::new() });
        *place = Some(job.clone());
        Some(JobPermit { slot: self.clone(), job })
    }

    /// Whether the place is taken.
    pub fn is_taken(&self) -> bool {
        self.lock().is_some()
    }

    /// Asks the job to end.
    pub fn cancel(&self) {
        self.cancel_where(|_| true);
    }

    /// Asks the job of a viewer to end.
    pub fn cancel_of(&self, viewer: u64) {
        self.cancel_where(|owner| owner == Some(viewer));
    }

    fn cancel_where(&self, matches: impl Fn(Option<u64>) -> bool) {
        if let Some(job) = self.lock().as_ref().filter(|job| matches(job.owner)) {
            job.cancelled.store(true, Ordering::Release);
            job.cancellation.notify_one();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Arc<Job>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl JobPermit {
    /// Flag that is set when the job is to end.
    pub fn cancelled(&self) -> &AtomicBool {
        &self.job.cancelled
    }

    /// Whether the job is to end.
    pub fn is_cancelled(&self) -> bool {
        self.job.cancelled.load(Ordering::Acquire)
    }

    /// Completes when the job is to end.
    pub async fn cancellation(&self) {
        self.job.cancellation.notified().await;
    }
}

impl Drop for JobPermit {
    fn drop(&mut self) {
        *self.slot.lock() = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_has_one_job_which_its_viewer_or_anybody_ends_and_comes_back() {
        let slot: Arc<JobSlot> = Arc::default();
        let job = slot.claim(Some(3)).expect("a free place");
        assert!(slot.is_taken() && slot.claim(Some(4)).is_none() && slot.claim(None).is_none());
        slot.cancel_of(4);
        assert!(!job.is_cancelled(), "another viewer has left");
        slot.cancel_of(3);
        assert!(job.is_cancelled() && slot.is_taken(), "the place is taken until the job has ended");
        drop(job);
        let job = slot.claim(None).expect("a free place");
        slot.cancel_of(3);
        assert!(!job.is_cancelled(), "a new job");
        slot.cancel();
        assert!(job.is_cancelled());
    }
}
