//! Who drives the stand: one client, for as long as its lease holds.
//!
//! In: beats of the driving page, requests for the control, the time. Out: whether the stand may be given signs of life, and whether the
//! drive has to be stopped. Pure state without a clock, a thread or a line, so that every transition is tested in virtual time.

use std::time::{Duration, Instant};

/// Longest time between two beats of the driving page.
pub const LEASE: Duration = Duration::from_secs(1);
/// Longest unattended job.
pub const MAX_UNATTENDED: Duration = Duration::from_secs(3600);

/// A connected page.
pub type ClientId = u64;
/// A client that never drives: the panel itself.
pub const NOBODY: ClientId = 0;

/// The client that drives.
#[derive(Debug, Clone, Copy)]
struct Driver {
    client: ClientId,
    lease_until: Instant,
}

/// Why a client may not drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ControlError {
    /// Another client drives.
    #[error("another page drives the stand; it can release the control, and every page can stop the drive")]
    Taken,
    /// The client has not taken the control, or its lease has expired.
    #[error("this page does not drive the stand: take the control first")]
    NotDriving,
}

/// The control of the stand.
#[derive(Debug, Default)]
pub struct Control {
    driver: Option<Driver>,
    /// End of a job that was confirmed to run without the page.
    unattended_until: Option<Instant>,
    /// A command of a program that drives has been sent, and the drive has not been reported off since.
    is_armed: bool,
}

impl Control {
    /// `client` takes the control.
    ///
    /// # Errors
    /// Another client holds it.
    pub fn take(&mut self, client: ClientId, now: Instant) -> Result<(), ControlError> {
        if self.unattended_until.is_some_and(|until| now < until) && self.driver.is_none_or(|driver| driver.client != client) {
            return Err(ControlError::Taken);
        }
        match self.driver {
            Some(driver) if driver.client != client && now < driver.lease_until => Err(ControlError::Taken),
            _ => {
                self.driver = Some(Driver { client, lease_until: now + LEASE });
                Ok(())
            }
        }
    }

    /// A beat of a page; only the driver's counts. An expired lease is not renewed: the page has to take the control again.
    pub fn beat(&mut self, client: ClientId, now: Instant) {
        if let Some(driver) = &mut self.driver
            && driver.client == client
            && now < driver.lease_until
        {
            driver.lease_until = now + LEASE;
        }
    }

    /// The page of the driver is hidden, closed or gives the control back; whether the drive has to be stopped.
    pub fn leave(&mut self, client: ClientId, now: Instant) -> bool {
        if self.driver.is_none_or(|driver| driver.client != client) || self.is_unattended(now) {
            return false;
        }
        self.driver = None;
        self.is_armed
    }

    /// The job of `client` may run without the page for this time.
    ///
    /// # Errors
    /// The client does not drive.
    pub fn run_unattended(&mut self, client: ClientId, duration: Duration, now: Instant) -> Result<(), ControlError> {
        self.check(client, now)?;
        self.unattended_until = Some(now + duration.min(MAX_UNATTENDED));
        Ok(())
    }

    /// The unattended job has ended; the lease holds for one more period, so that a page that is open keeps the control.
    pub fn end_unattended(&mut self, now: Instant) {
        if self.unattended_until.take().is_some()
            && let Some(driver) = &mut self.driver
        {
            driver.lease_until = driver.lease_until.max(now + LEASE);
        }
    }

    /// Whether `client` drives.
    ///
    /// # Errors
    /// Another client drives, or none.
    pub fn check(&self, client: ClientId, now: Instant) -> Result<(), ControlError> {
        match self.driver {
            Some(driver) if driver.client == client && self.holds(now) => Ok(()),
            Some(driver) if driver.client != client && self.holds(now) => Err(ControlError::Taken),
            _ => Err(ControlError::NotDriving),
        }
    }

    /// The client that drives.
    pub fn driver(&self, now: Instant) -> Option<ClientId> {
        self.driver.filter(|_| self.holds(now)).map(|driver| driver.client)
    }

    /// A command of a program that drives is about to be sent.
    pub fn arm(&mut self) {
        self.is_armed = true;
    }

    /// The stand has reported its drive off.
    pub fn disarm(&mut self) {
        self.is_armed = false;
    }

    /// The drive may be on.
    pub fn is_armed(&self) -> bool {
        self.is_armed
    }

    /// Signs of life may be sent to the stand.
    pub fn feeds(&self, now: Instant) -> bool {
        self.is_armed && self.holds(now)
    }

    /// The lease has run out; the driver loses the control. True, once, if the drive has to be stopped.
    pub fn expire(&mut self, now: Instant) -> bool {
        if self.driver.is_none() || self.holds(now) {
            return false;
        }
        self.driver = None;
        self.unattended_until = None;
        self.is_armed
    }

    /// Ends the control: after a stop nobody drives until a client takes it again.
    pub fn revoke(&mut self) {
        self.driver = None;
        self.unattended_until = None;
    }

    fn is_unattended(&self, now: Instant) -> bool {
        self.unattended_until.is_some_and(|until| now < until)
    }

    fn holds(&self, now: Instant) -> bool {
        self.driver.is_some_and(|driver| now < driver.lease_until) || (self.driver.is_some() && self.is_unattended(now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn lease_expires_after_a_second_without_beats_and_is_not_renewed() {
        let (mut control, t0) = (Control::default(), Instant::now());
        control.take(1, t0).unwrap();
        control.arm();
        control.beat(1, t0 + 900 * MS);
        assert!(control.feeds(t0 + 1899 * MS) && !control.expire(t0 + 1899 * MS));
        assert!(!control.feeds(t0 + 1901 * MS), "not fed from the first moment on");
        assert!(control.expire(t0 + 1901 * MS) && !control.expire(t0 + 1902 * MS), "the stop is due once");
        control.beat(1, t0 + 1903 * MS);
        assert_eq!(control.check(1, t0 + 1903 * MS), Err(ControlError::NotDriving), "a late beat resumes nothing");
    }

    #[test]
    fn one_client_drives_and_beats_of_another_do_not_count() {
        let (mut control, t0) = (Control::default(), Instant::now());
        control.take(1, t0).unwrap();
        assert_eq!(control.take(2, t0), Err(ControlError::Taken));
        control.beat(2, t0 + 500 * MS);
        assert!(control.check(1, t0 + 1001 * MS).is_err());
        control.take(2, t0 + 1001 * MS).unwrap();
        assert_eq!(control.check(1, t0 + 1002 * MS), Err(ControlError::Taken));
    }

    #[test]
    fn stand_that_does_not_drive_is_not_stopped_when_the_page_leaves() {
        let (mut control, t0) = (Control::default(), Instant::now());
        control.take(1, t0).unwrap();
        assert!(!control.leave(1, t0));
        control.take(1, t0).unwrap();
        control.arm();
        assert!(!control.leave(2, t0), "another page");
        assert!(control.leave(1, t0));
    }

    #[test]
    fn unattended_job_holds_the_control_for_its_time_only() {
        let (mut control, t0) = (Control::default(), Instant::now());
        control.take(1, t0).unwrap();
        control.arm();
        control.run_unattended(1, 5000 * MS, t0).unwrap();
        assert!(!control.leave(1, t0 + 10 * MS) && control.feeds(t0 + 4999 * MS));
        assert_eq!(control.take(2, t0 + 3000 * MS), Err(ControlError::Taken));
        assert!(!control.feeds(t0 + 5001 * MS) && control.expire(t0 + 5001 * MS));
        assert!(control.run_unattended(1, MS, t0 + 6000 * MS).is_err());

        control.take(1, t0).unwrap();
        control.run_unattended(1, 5000 * MS, t0).unwrap();
        control.end_unattended(t0 + 3000 * MS);
        assert!(!control.expire(t0 + 3900 * MS), "the drive is reported off meanwhile");
        control.disarm();
        assert!(!control.expire(t0 + 4001 * MS) && control.driver(t0 + 4001 * MS).is_none(), "nothing is left to stop");
    }
}
