//! Drivers of real devices against stand-ins for their makers' software: no vendor's library, service or hardware was there.

mod dhd;
mod haply;
mod openhaptics;
mod places;
mod sessions;
mod standin;
