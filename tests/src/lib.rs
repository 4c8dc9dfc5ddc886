//! What the end-to-end tests share: isolated domains, child processes that end with the test, bounded waits.
