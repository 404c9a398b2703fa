"""Calls that only POSIX systems have are used in few guarded places, which are listed here.

The test cannot find calls that behave differently on Windows.
"""

import re

from tests.support.paths import ROOT

PACKAGES = ("sealtwin", "digitise", "simulate", "validate")
MODULES = "crypt curses fcntl grp posix pty pwd readline resource syslog termios tty"
NAMES = {
    "os": """
    F_LOCK F_TLOCK F_ULOCK O_CLOEXEC O_DIRECT O_DIRECTORY O_DSYNC O_NOCTTY O_NOFOLLOW O_NONBLOCK O_PATH O_SYNC O_TMPFILE
    WNOHANG chown chroot confstr copy_file_range ctermid environb eventfd fchdir fchmod fchown fdatasync fork forkpty
    fpathconf fstatvfs getegid getenvb geteuid getgid getgroups getloadavg getpgid getpgrp getpriority getrandom
    getresuid getsid getuid getxattr initgroups kill killpg lchown listxattr lockf major memfd_create minor mkfifo mknod
    nice openpty pathconf pidfd_open posix_fadvise posix_fallocate posix_spawn posix_spawnp pread preadv pwrite pwritev
    readv register_at_fork removexattr sched_getaffinity sched_setaffinity sched_yield sendfile setegid seteuid setgid
    setpgid setpriority setsid setuid setxattr statvfs sync sysconf tcgetpgrp tcsetpgrp ttyname uname wait wait3 wait4
    waitid writev
    """,
    "signal": """
    SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIGWINCH alarm getitimer
    pause pthread_kill pthread_sigmask setitimer siginterrupt sigpending sigtimedwait sigwait
    """,
    "socket": "AF_UNIX SO_REUSEPORT",
    "select": "poll epoll kqueue select",
}
"""os.kill is on Windows, too, but ends a process, or sends Ctrl-C for 0. select takes no pipes there."""


def _any(words: str) -> str:
    return f"(?:{'|'.join(words.split())})"


POSIX = re.compile(
    "|".join(
        [
            rf"\bimport {_any(MODULES)}\b|\bfrom {_any(MODULES)} import\b",
            *(rf"\b{module}\.{_any(names)}\b" for module, names in NAMES.items()),
            *(rf"\bfrom {module} import .*\b{_any(names)}\b" for module, names in NAMES.items()),
            *(rf"\bgetattr\({module}, [\"']{_any(names)}[\"']" for module, names in NAMES.items()),
            r"get_context\([\"'](?:fork|forkserver)[\"']",
            rf"\b{_any('dir_fd pass_fds preexec_fn start_new_session')}=",
            rf"[\"']/{_any('dev etc proc tmp usr var')}/",
            # Links require a right that users of Windows lack.
            rf"\.{_any('hardlink_to symlink_to')}\(",
        ]
    )
)
ALLOWED = {
    # The code asks hasattr or the platform before each use.
    ("sealtwin/core/workers.py", "os.sched_getaffinity"),
    ("sealtwin/core/workers.py", "signal.pthread_sigmask"),
    ("simulate/fluid/walkers.py", "os.setpriority"),
}


def test_posix_only_calls_are_used_only_in_listed_modules():
    uses = {
        (path.relative_to(ROOT).as_posix(), use)
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        for use in POSIX.findall(path.read_text(encoding="utf-8"))
    }
    assert uses == ALLOWED
