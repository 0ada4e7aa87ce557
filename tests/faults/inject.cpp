// Preloaded into the program (LD_PRELOAD), makes one of its calls to the system fail once.
//   TRUNNION_FAIL=CALL:N:ERROR   the N-th call (from 1) of CALL fails with ERROR (ENOSPC, EIO, EINTR, EMFILE,
//   ENOMEM, EAGAIN) TRUNNION_CALLS=FILE          how often each call was made, written at the end
// `malloc` counts what asks for kLargeBlock bytes and more, operator new included.
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

extern "C" {
void* __libc_malloc(std::size_t);               // NOLINT: glibc's own, which needs no look-up
void* __libc_calloc(std::size_t, std::size_t);  // NOLINT
void* __libc_realloc(void*, std::size_t);       // NOLINT
}

namespace {

constexpr std::size_t kLargeBlock = 512;

enum Call {
  open_call,
  read_call,
  write_call,
  fsync_call,
  rename_call,
  mmap_call,
  malloc_call,
  thread_call,
  accept_call,
  count_of_calls
};
constexpr std::array<const char*, count_of_calls> kNames = {
    "open", "read", "write", "fsync", "rename", "mmap", "malloc", "pthread_create", "accept"};

struct Plan {
  int call = -1;
  long n = 0;
  int error = 0;
};

std::array<std::atomic<long>, count_of_calls> made;
std::atomic<bool> ready;
Plan plan;

int error_of(const char* name) {
  struct Named {
    const char* name;
    int error;
  };
  constexpr std::array<Named, 6> kErrors = {Named{"ENOSPC", ENOSPC}, {"EIO", EIO},       {"EINTR", EINTR},
                                            {"EMFILE", EMFILE},      {"ENOMEM", ENOMEM}, {"EAGAIN", EAGAIN}};
  for (const Named& e : kErrors)
    if (std::strcmp(e.name, name) == 0) return e.error;
  return EIO;
}

// Counted from here on: what the loader did before is not the program's.
__attribute__((constructor)) void begin() {
  if (const char* text = std::getenv("TRUNNION_FAIL")) {
    std::array<char, 32> call{};
    std::array<char, 32> error{};
    if (std::sscanf(text, "%31[^:]:%ld:%31s", call.data(), &plan.n, error.data()) == 3) {
      for (int i = 0; i < count_of_calls; ++i)
        if (std::strcmp(kNames[static_cast<std::size_t>(i)], call.data()) == 0) plan.call = i;
      plan.error = error_of(error.data());
    }
  }
  ready = true;
}

__attribute__((destructor)) void end() {
  ready = false;
  const char* const path = std::getenv("TRUNNION_CALLS");
  if (path == nullptr) return;
  const auto file =
      static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, 0666));
  for (std::size_t i = 0; i < made.size(); ++i) {
    std::array<char, 64> line{};
    const int size = std::snprintf(line.data(), line.size(), "%s %ld\n", kNames[i], made[i].load());
    ::syscall(SYS_write, file, line.data(), size);
  }
  ::syscall(SYS_close, file);
}

// Whether this call is the one.
bool fails(Call call) {
  if (!ready) return false;
  const long n = ++made[call];
  if (plan.call != call || plan.n != n) return false;
  errno = plan.error;
  return true;
}

template <class Function>
Function real(const char* name) {
  void* const found = ::dlsym(RTLD_NEXT, name);
  Function out;
  std::memcpy(&out, &found, sizeof out);
  return out;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  std::va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  if (fails(open_call)) return -1;
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}
int open64(const char* path, int flags, ...) {
  std::va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return open(path, flags, mode);
}
ssize_t read(int file, void* to, std::size_t size) {
  return fails(read_call) ? -1 : ::syscall(SYS_read, file, to, size);
}
ssize_t pread(int file, void* to, std::size_t size, off_t at) {
  return fails(read_call) ? -1 : ::syscall(SYS_pread64, file, to, size, at);
}
ssize_t pread64(int file, void* to, std::size_t size, off_t at) {
  return pread(file, to, size, at);
}
ssize_t write(int file, const void* from, std::size_t size) {
  return fails(write_call) ? -1 : ::syscall(SYS_write, file, from, size);
}
ssize_t pwrite(int file, const void* from, std::size_t size, off_t at) {
  return fails(write_call) ? -1 : ::syscall(SYS_pwrite64, file, from, size, at);
}
ssize_t pwrite64(int file, const void* from, std::size_t size, off_t at) {
  return pwrite(file, from, size, at);
}
int fsync(int file) {
  return fails(fsync_call) ? -1 : static_cast<int>(::syscall(SYS_fsync, file));
}
int rename(const char* from, const char* to) {
  return fails(rename_call) ? -1 : static_cast<int>(::syscall(SYS_rename, from, to));
}
int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  return fails(rename_call)
             ? -1
             : static_cast<int>(::syscall(SYS_linkat, from_folder, from, to_folder, to, flags));
}
int accept4(int socket, sockaddr* address, socklen_t* size, int flags) {
  return fails(accept_call) ? -1 : static_cast<int>(::syscall(SYS_accept4, socket, address, size, flags));
}
void* mmap(void* at, std::size_t size, int protection, int flags, int file, off_t offset) {
  if (fails(mmap_call)) return MAP_FAILED;
  const long got = ::syscall(SYS_mmap, at, size, protection, flags, file, offset);
  return reinterpret_cast<void*>(got);  // NOLINT: as the call gives it
}
void* malloc(std::size_t size) {
  return size >= kLargeBlock && fails(malloc_call) ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  return count * size >= kLargeBlock && fails(malloc_call) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  return size >= kLargeBlock && fails(malloc_call) ? nullptr : __libc_realloc(block, size);
}
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* argument) {
  using Function = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto function = real<Function>("pthread_create");
  return fails(thread_call) ? plan.error : function(thread, attributes, run, argument);
}

}  // extern "C"
