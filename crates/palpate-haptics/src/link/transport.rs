//! How QUIC is set up for a stream of small datagrams that grow old in milliseconds.

use quinn::congestion::{Controller, ControllerFactory};
use quinn::{IdleTimeout, TransportConfig, VarInt};
use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Nothing heard for so long: the other end is gone.
const GONE: Duration = Duration::from_millis(1000);

/// Something is said at least so often.
const ALIVE: Duration = Duration::from_millis(200);

/// Bytes under way at most: a tenth of a second of both directions at 4 kHz.
const WINDOW: u64 = 128 * 1024;

/// Bytes that wait to be sent: what has to wait longer is too old.
const WAITING: usize = 2048;

/// A rate that the device sets, not the losses: 100 kB/s at 1 kHz crowd nobody out, and a force that comes half as often is no
/// help.
#[derive(Debug, Clone, Copy)]
struct Steady;

impl Controller for Steady {
    fn on_congestion_event(&mut self, _: Instant, _: Instant, _: bool, _: u64) {}

    fn on_mtu_update(&mut self, _: u16) {}

    fn window(&self) -> u64 {
        WINDOW
    }

    fn clone_box(&self) -> Box<dyn Controller> {
        Box::new(*self)
    }

    fn initial_window(&self) -> u64 {
        WINDOW
    }

    fn into_any(self: Box<Self>) -> Box<dyn Any> {
        self
    }
}

impl ControllerFactory for Steady {
    fn build(self: Arc<Self>, _: Instant, _: u16) -> Box<dyn Controller> {
        Box::new(*self)
    }
}

pub(super) fn transport() -> Arc<TransportConfig> {
    let mut config = TransportConfig::default();
    config
        .max_idle_timeout(Some(IdleTimeout::from(VarInt::from_u32(GONE.as_millis() as u32))))
        .keep_alive_interval(Some(ALIVE))
        .congestion_controller_factory(Arc::new(Steady))
        .datagram_send_buffer_size(WAITING)
        .max_concurrent_bidi_streams(VarInt::from_u32(1))
        .max_concurrent_uni_streams(VarInt::from_u32(0))
        .enable_segmentation_offload(false);
    Arc::new(config)
}
