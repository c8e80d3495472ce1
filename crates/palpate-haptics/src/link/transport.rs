//! QUIC transport settings for a stream of small datagrams that are outdated within milliseconds.

use quinn::congestion::{Controller, ControllerFactory};
use quinn::{IdleTimeout, TransportConfig, VarInt};
use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Idle timeout: silence after which a link counts as broken.
const IDLE_TIMEOUT: Duration = Duration::from_millis(1000);

/// Keep-alive interval.
const KEEP_ALIVE: Duration = Duration::from_millis(200);

/// Congestion window [bytes]: 0.1 s of both directions at 4 kHz.
const WINDOW: u64 = 128 * 1024;

/// Send buffer for datagrams [bytes]: what would wait longer is outdated.
const SEND_BUFFER: usize = 2048;

/// Congestion controller with a constant window: the device sets the rate, losses do not lower it. 100 kB/s at 1 kHz need no
/// congestion control, and forces at half the rate would be worse than lost ones.
#[derive(Debug, Clone, Copy)]
struct ConstantWindow;

impl Controller for ConstantWindow {
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

impl ControllerFactory for ConstantWindow {
    fn build(self: Arc<Self>, _: Instant, _: u16) -> Box<dyn Controller> {
        Box::new(*self)
    }
}

/// Transport settings of both ends.
pub(super) fn transport() -> Arc<TransportConfig> {
    let mut config = TransportConfig::default();
    config
        .max_idle_timeout(Some(IdleTimeout::from(VarInt::from_u32(IDLE_TIMEOUT.as_millis() as u32))))
        .keep_alive_interval(Some(KEEP_ALIVE))
        .congestion_controller_factory(Arc::new(ConstantWindow))
        .datagram_send_buffer_size(SEND_BUFFER)
        .max_concurrent_bidi_streams(VarInt::from_u32(1))
        .max_concurrent_uni_streams(VarInt::from_u32(0))
        .enable_segmentation_offload(false);
    Arc::new(config)
}
