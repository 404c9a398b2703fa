"""The packages call nothing that only POSIX systems have, but for guarded places that are listed here.

What this cannot find: a call that Windows has and that behaves differently there.
"""

import ast

import pytest

from tests.places import ROOT

PACKAGES = ("sealtwin", "digitise", "simulate", "validate")
MODULES = {"crypt", "curses", "fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
OF_OS = """
F_LOCK F_TLOCK F_ULOCK O_CLOEXEC O_DIRECT O_DIRECTORY O_DSYNC O_NOCTTY O_NOFOLLOW O_NONBLOCK O_PATH O_SYNC O_TMPFILE
WNOHANG chown chroot confstr copy_file_range ctermid environb eventfd fchdir fchmod fchown fdatasync fork forkpty
fpathconf fstatvfs getegid getenvb geteuid getgid getgroups getloadavg getpgid getpgrp getpriority getrandom getresuid
getsid getuid getxattr initgroups kill killpg lchown listxattr lockf major memfd_create minor mkfifo mknod nice
openpty pathconf pidfd_open posix_fadvise posix_fallocate posix_spawn posix_spawnp pread preadv pwrite pwritev readv
register_at_fork removexattr sched_getaffinity sched_setaffinity sched_yield sendfile setegid seteuid setgid setpgid
setpriority setsid setuid setxattr statvfs sync sysconf tcgetpgrp tcsetpgrp ttyname uname wait wait3 wait4 waitid
writev
"""
OF_SIGNAL = """
SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIGWINCH alarm getitimer pause
pthread_kill pthread_sigmask setitimer siginterrupt sigpending sigtimedwait sigwait
"""
NAMES = {
    "os": set(OF_OS.split()),
    "signal": set(OF_SIGNAL.split()),
    "socket": {"AF_UNIX", "SO_REUSEPORT"},
    "select": {"poll", "epoll", "kqueue", "select"},
    "multiprocessing": {"fork", "forkserver"},
}
"""os.kill is on Windows, too, but ends a process, or sends Ctrl-C for 0. select takes no pipes there."""
OPTIONS = {"dir_fd", "pass_fds", "preexec_fn", "start_new_session"}
PLACES = ("/dev/", "/etc/", "/proc/", "/tmp/", "/usr/", "/var/")
METHODS = {"hardlink_to", "symlink_to"}
"""On Windows they take a right that users lack."""
ALLOWED = {
    # hasattr before it, and else all cores.
    ("sealtwin/core/cluster.py", "cores", "os.sched_getaffinity"),
    ("sealtwin/core/cluster.py", "_block_interrupts", "signal.pthread_sigmask"),
}


KINDS = (ast.Import, ast.ImportFrom, ast.Attribute, ast.Call, ast.keyword, ast.Constant)


def _uses(tree: ast.AST):
    """Each name that only POSIX has, with the function that it stands in; and whether that function guards it."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    for node in ast.walk(tree):
        for name in _names(node) if isinstance(node, KINDS) else ():
            line = getattr(node, "lineno", 0)
            inside = [one for one in functions if one.lineno <= line <= (one.end_lineno or one.lineno)]
            where = max(inside, key=lambda one: one.lineno, default=None)
            yield name, "" if where is None else where.name, where is not None and _guards(where, name)


def _names(node: ast.AST):
    match node:
        case ast.Import(names=names):
            yield from (alias.name for alias in names if alias.name in MODULES)
        case ast.ImportFrom(module=str(module), names=names):
            if module in MODULES:
                yield module
            yield from (f"{module}.{alias.name}" for alias in names if alias.name in NAMES.get(module, ()))
        case ast.Attribute(value=ast.Name(id=module), attr=name) if name in NAMES.get(module, ()):
            yield f"{module}.{name}"
        case ast.Attribute(attr=name) if name in METHODS:
            yield name
        case ast.Call(func=ast.Name(id="getattr"), args=[ast.Name(id=module), ast.Constant(value=name), *_]):
            if name in NAMES.get(module, ()):
                yield f"{module}.{name}"
        case ast.Call(
            func=ast.Name(id="get_context") | ast.Attribute(attr="get_context"), args=[ast.Constant(value=v)]
        ):
            if v in NAMES["multiprocessing"]:
                yield f"multiprocessing.{v}"
        case ast.keyword(arg=str(name)) if name in OPTIONS:
            yield name
        case ast.Constant(value=str(text)) if text.startswith(PLACES):
            yield text
        case _:
            pass


def _guards(function: ast.AST, name: str) -> bool:
    """Whether a function asks for the name, or for the system, before it takes it for granted."""
    for node in ast.walk(function):
        match node:
            case ast.Call(func=ast.Name(id="hasattr"), args=[ast.Name(id=module), ast.Constant(value=attribute)]):
                asked = f"{module}.{attribute}" == name
            case ast.Call(func=ast.Name(id="getattr"), args=[ast.Name(id=module), ast.Constant(value=attribute), _]):
                asked = f"{module}.{attribute}" == name
            case ast.Compare(left=ast.Attribute(value=ast.Name(id="sys"), attr="platform")):
                asked = True
            case _:
                asked = False
        if asked:
            return True
    return False


@pytest.mark.broad
def test_what_only_posix_has_stands_in_listed_places_alone():
    uses = {
        (path.relative_to(ROOT).as_posix(), function, name): guarded
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        for name, function, guarded in _uses(ast.parse(path.read_text(encoding="utf-8")))
    }
    assert set(uses) == ALLOWED
    assert all(uses.values()), "listed, but not guarded"


def test_each_kind_of_use_is_found():
    uses = {
        "import fcntl": "fcntl",
        "from os import fork": "os.fork",
        "process.send_signal(signal.SIGKILL)": "signal.SIGKILL",
        "open_(path, getattr(os, 'O_DIRECTORY'))": "os.O_DIRECTORY",
        "Popen(command, start_new_session=True)": "start_new_session",
        "get_context('fork')": "multiprocessing.fork",
        "Path('/proc/meminfo').read_text()": "/proc/meminfo",
        "path.symlink_to(other)": "symlink_to",
    }
    for code, name in uses.items():
        assert list(_uses(ast.parse(f"def plain():\n    {code}\n"))) == [(name, "plain", False)]
    guarded = "def asks():\n    if sys.platform != 'win32':\n        os.sync()\n"
    assert list(_uses(ast.parse(guarded))) == [("os.sync", "asks", True)]
