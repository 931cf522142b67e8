// SPDX-License-Identifier: Apache-2.0
// Python's lock, given up and taken on threads that the interpreter may leave behind.
//
// Before Python 3.14 a thread that asks for the lock of an interpreter that has ended is unwound, as by an exception.
// On the way are destructors, nanobind's functions and others that let none through, where the process would abort.
// Such a thread rests here for good instead, as from 3.14 on; the end of the process takes it along.
#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <thread>

namespace hw::python {

[[noreturn]] inline void rest_for_good() {
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

// Other threads run Python while it lives.
class WithoutGil {
 public:
  WithoutGil() : state_(PyEval_SaveThread()) {}
  ~WithoutGil() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      rest_for_good();
    }
  }
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

 private:
  PyThreadState* state_;
};

// This thread, whichever it is, may use Python while it lives.
class WithGil {
 public:
  WithGil() {
    try {
      state_ = PyGILState_Ensure();
    } catch (...) {
      rest_for_good();
    }
  }
  ~WithGil() { PyGILState_Release(state_); }
  WithGil(const WithGil&) = delete;
  WithGil& operator=(const WithGil&) = delete;

 private:
  PyGILState_STATE state_;
};

}  // namespace hw::python
