"""A process that is made to say where it is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

from regraft.process.abort import abort

STOPS = """
import faulthandler, os, signal, threading, time

faulthandler.enable()

def pass_the_time():
    while True:
        time.sleep(0.0001)

def stop():
    os.kill(os.getpid(), signal.SIGSTOP)

for _ in range(8):
    threading.Thread(target=pass_the_time, daemon=True).start()
stop()
time.sleep(10)
"""
PROCESSES = 20


def test_a_stopped_process_says_where_its_main_thread_was_stopped_whatever_its_other_threads_do() -> None:
    for _ in range(PROCESSES):
        stopped = subprocess.Popen([sys.executable, "-c", STOPS], stderr=subprocess.PIPE, text=True)
        os.waitpid(stopped.pid, os.WUNTRACED)
        abort(stopped.pid)
        assert "in stop" in stopped.communicate(timeout=10.0)[1]
        assert stopped.returncode == -signal.SIGABRT
