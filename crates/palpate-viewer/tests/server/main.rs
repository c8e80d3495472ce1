//! Server on loopback, with well-behaved and hostile clients.

mod client;
mod guard;
mod live;
mod logging;
mod logs;
