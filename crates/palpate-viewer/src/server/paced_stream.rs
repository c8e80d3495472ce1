//! Connection that is closed when its client takes what is sent to it too slowly.

use super::limits::Limits;
use std::io::{self, ErrorKind, IoSlice};
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, Sleep, sleep};

/// Connection whose client pays for time: each second in which it takes nothing though something waits counts, each byte that it
/// takes pays back what [`Limits::take_rate`] allows for it, and [`Limits::write_time`] is its credit (a token bucket).
pub(super) struct PacedStream<S> {
    stream: S,
    credit: Duration,
    rate: f64,
    /// Time that the client is behind.
    debt: Duration,
    /// Start of the wait for the client.
    waiting_since: Option<Instant>,
    /// End of the credit, while waiting.
    deadline: Pin<Box<Sleep>>,
}

impl<S: AsyncWrite + Unpin> PacedStream<S> {
    /// Connection under the limits on what a client takes.
    pub fn new(stream: S, limits: &Limits) -> Self {
        let deadline = Box::pin(sleep(limits.write_time));
        Self {
            stream,
            credit: limits.write_time,
            rate: limits.take_rate.max(1.0),
            debt: Duration::ZERO,
            waiting_since: None,
            deadline,
        }
    }

    fn write(
        &mut self,
        context: &mut Context<'_>,
        poll: impl FnOnce(Pin<&mut S>, &mut Context<'_>) -> Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        let Poll::Ready(written) = poll(Pin::new(&mut self.stream), context) else {
            if self.waiting_since.is_none() {
                let now = Instant::now();
                self.waiting_since = Some(now);
                self.deadline.as_mut().reset(now + self.credit.saturating_sub(self.debt));
            }
            ready!(self.deadline.as_mut().poll(context));
            return Poll::Ready(Err(io::Error::new(
                ErrorKind::TimedOut,
                "the client takes its answer too slowly",
            )));
        };
        if let Some(since) = self.waiting_since.take() {
            self.debt += since.elapsed();
        }
        let bytes = written?;
        self.debt = self.debt.saturating_sub(Duration::from_secs_f64(bytes as f64 / self.rate));
        Poll::Ready(Ok(bytes))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for PacedStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.write(context, |stream, context| stream.poll_write(context, bytes))
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.write(context, |stream, context| stream.poll_write_vectored(context, parts))
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for PacedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    /// Time until a client that takes `bytes` every `interval` is cut off, if it is within 100 s.
    fn time_kept(bytes: usize, interval: Duration) -> Option<Duration> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
        runtime.expect("a runtime").block_on(async {
            let limits =
                Limits { write_time: Duration::from_secs(10), take_rate: 1000.0, ..Limits::default() };
            let (server, mut client) = duplex(64);
            tokio::spawn(async move {
                let mut part = vec![0; bytes];
                loop {
                    sleep(interval).await;
                    let _ = client.read_exact(&mut part).await;
                }
            });
            let mut stream = PacedStream::new(server, &limits);
            let begin = Instant::now();
            let sent = tokio::time::timeout(Duration::from_secs(100), stream.write_all(&[0; 1 << 20])).await;
            sent.ok().map(|result| {
                assert_eq!(result.expect_err("a client that is cut off").kind(), ErrorKind::TimedOut);
                begin.elapsed()
            })
        })
    }

    #[test]
    fn a_client_that_takes_nothing_or_bytes_now_and_then_is_cut_off_and_a_slow_one_is_served() {
        let seconds = Duration::from_secs_f64;
        assert_eq!(time_kept(1, seconds(1000.0)), Some(seconds(10.0)));
        // Byte by byte, at a hundredth of the rate.
        let kept = time_kept(1, seconds(0.1)).expect("it is cut off").as_secs_f64();
        assert!((10.0..10.3).contains(&kept), "{kept} s");
        // At half the rate: it pays back half of its time.
        let kept = time_kept(50, seconds(0.1)).expect("it is cut off").as_secs_f64();
        assert!((19.5..20.5).contains(&kept), "{kept} s");
        assert_eq!(time_kept(110, seconds(0.1)), None, "faster than the rate");
    }
}
