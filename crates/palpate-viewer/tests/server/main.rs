//! Server on loopback, with well-behaved and hostile clients.

mod client;
mod flood;
mod guard;
mod jobs;
mod live;
mod logging;
mod logs;
mod slow_clients;
mod sound;
mod tls;
