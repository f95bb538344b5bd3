// The calls of the loop neither take memory from the system nor give it back, take no lock and make no system call.
//
// Takes the number of ticks for each kind of grasp. Every function of the C library that allocates is counted, and so
// are the locks of pthread. Then the same loop runs where the kernel ends a process that makes a system call.

#include "random_grasps.hpp"

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <dlfcn.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <new>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {
bool counting = false;
std::size_t allocations = 0, releases = 0, locks = 0;
} // namespace

// glibc's own functions, which those below stand before.
extern "C" {
void *__libc_malloc(std::size_t);
void *__libc_calloc(std::size_t, std::size_t);
void *__libc_realloc(void *, std::size_t);
void *__libc_memalign(std::size_t, std::size_t);
void __libc_free(void *);

void *malloc(std::size_t size) {
    allocations += counting;
    return __libc_malloc(size);
}
void *calloc(std::size_t count, std::size_t size) {
    allocations += counting;
    return __libc_calloc(count, size);
}
void *realloc(void *pointer, std::size_t size) {
    allocations += counting;
    return __libc_realloc(pointer, size);
}
void *aligned_alloc(std::size_t alignment, std::size_t size) {
    allocations += counting;
    return __libc_memalign(alignment, size);
}
int posix_memalign(void **pointer, std::size_t alignment, std::size_t size) {
    allocations += counting;
    *pointer = __libc_memalign(alignment, size);
    return *pointer ? 0 : ENOMEM;
}
void free(void *pointer) {
    releases += counting;
    __libc_free(pointer);
}
int pthread_mutex_lock(pthread_mutex_t *mutex) {
    locks += counting;
    static const auto real = reinterpret_cast<int (*)(pthread_mutex_t *)>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
    return real(mutex);
}
}

void *operator new(std::size_t size) { return std::malloc(size); }
void operator delete(void *pointer) noexcept { std::free(pointer); }
void operator delete(void *pointer, std::size_t) noexcept { std::free(pointer); }

namespace {

/// How often each status came.
using Ends = std::array<std::size_t, 32>;

/// Wrenches along a path, jumps, what cannot be balanced or used, and contacts that roll.
class ControlLoop {
public:
    ControlLoop(const Kind &kind, std::uint64_t seed)
        : kind_(kind), random_(seed), arrays_(kind, seed), other_(kind, seed + 1), grasp_(grasp_of(kind, arrays_)),
          another_(grasp_of(kind, other_)), distributor_(distributor_of(kind, arrays_, grasp_)),
          forces_(gf_grasp_num_contacts(grasp_) * gf_grasp_force_dim(grasp_)), wrench_(gf_grasp_wrench_dim(grasp_)),
          limits_(gf_grasp_num_contacts(grasp_)) {
        gf_solution_init(&solution_, sizeof solution_);
    }
    ControlLoop(const ControlLoop &) = delete;
    ControlLoop &operator=(const ControlLoop &) = delete;
    ~ControlLoop() {
        gf_distributor_destroy(distributor_);
        gf_grasp_destroy(grasp_);
        gf_grasp_destroy(another_);
    }

    void tick(std::size_t step, Ends &ends) {
        const bool jump = step % 4 == 3;
        for (std::size_t k = 0; k < wrench_.size(); ++k) {
            const double phase = 1e-3 * static_cast<double>(step) + 1.7 * static_cast<double>(k);
            wrench_[k] = (k < kind_.dim ? 1.0 : kind_.scale) * (jump ? random_.within(-2.0, 2.0) : std::sin(phase));
        }
        if (step % 101 == 50) wrench_[0] = NAN;
        if (step % 103 == 51) wrench_.assign(wrench_.size(), 0.0);
        if (step % 107 == 52) wrench_[1] *= 1e160;
        const std::size_t length = wrench_.size() + (step % 109 == 53);
        gf_solution *solution = step % 3 == 0 ? &solution_ : nullptr;
        char *message = step % 5 == 0 ? nullptr : message_;
        ends[gf_distributor_solve(distributor_, wrench_.data(), length, forces_.data(), forces_.size(), solution, message,
                                  sizeof message_)]++;
        if (step % 2 == 1) {
            double distance;
            if (step % 7 == 3)
                for (double &x : wrench_) x *= 1e3;
            ends[gf_distributor_nearest(distributor_, wrench_.data(), length, forces_.data(), forces_.size(), &distance,
                                        solution, message, sizeof message_)]++;
        }
        if (step % 5 == 2) {
            for (std::size_t i = 0; i < limits_.size(); ++i)
                limits_[i] = random_.within(-0.3, 1.0) < 0.0 ? 0.0 : arrays_.limits[i] * random_.within(0.5, 2.0);
            ends[gf_distributor_set_limits(distributor_, limits_.data(), limits_.size(), message, sizeof message_)]++;
        }
        if (step % 41 == 17) {
            arrays_.roll(random_);
            ends[gf_distributor_update_contacts(distributor_, &arrays_.contacts, nullptr, message, sizeof message_)]++;
        }
        if (step % 43 == 18) ends[gf_distributor_update(distributor_, another_, message, sizeof message_)]++;
        if (step % 47 == 19) ends[gf_distributor_forget(distributor_)]++;
    }

private:
    const Kind &kind_;
    Random random_;
    Arrays arrays_, other_;
    gf_grasp *grasp_, *another_;
    gf_distributor *distributor_;
    std::vector<double> forces_, wrench_, limits_;
    gf_solution solution_;
    char message_[160];
};

/// Whether `loop` ends in a process that the kernel kills for a system call; 2 where the kernel has no such mode.
int system_calls(ControlLoop &loop, std::size_t ticks) {
    const pid_t child = fork();
    if (child == 0) {
        // The clock, by which the interior-point solver times itself, is mostly read without a system call.
        sock_filter rules[] = {
            BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit, 2, 0),
            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clock_gettime, 1, 0),
            BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
            BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
        };
        const sock_fprog filter = {sizeof rules / sizeof rules[0], rules};
        if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0)
            _exit(2);
        Ends ends{};
        for (std::size_t step = 0; step < ticks; ++step) loop.tick(step, ends);
        syscall(SYS_exit, 0);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) fail("no second process");
    return WIFSIGNALED(status) ? 1 : WEXITSTATUS(status);
}

} // namespace

int main(int count, char **arguments) {
    const std::size_t ticks = count > 1 ? std::strtoul(arguments[1], nullptr, 10) : 10000;
    bool clean = true, seccomp = true;
    for (const Kind &kind : kinds) {
        allocations = 0;
        counting = true;
        ControlLoop loop(kind, 7), again(kind, 7);
        counting = false;
        if (allocations == 0) fail("what is made allocates nothing: the counters do not count");
        Ends ends{};
        allocations = releases = locks = 0;
        counting = true;
        for (std::size_t step = 0; step < ticks; ++step) loop.tick(step, ends);
        counting = false;
        const int ended = system_calls(again, ticks);
        seccomp = seccomp && ended != 2;
        std::printf("%-36s %zu ticks: %zu allocations, %zu releases, %zu locks, system calls: %s;", kind.name, ticks,
                    allocations, releases, locks, ended == 0 ? "none" : ended == 1 ? "SOME" : "not watched");
        for (int status = 0; status < 32; ++status)
            if (ends[status]) std::printf(" %zu %s", ends[status], gf_status_name(status));
        std::printf("\n");
        clean = clean && allocations == 0 && releases == 0 && locks == 0 && ended != 1 && ends[GF_STATUS_SOLVED] > 0 &&
                ends[GF_STATUS_INVALID] > 0 && ends[GF_STATUS_WRONG_LENGTH] > 0 && ends[GF_STATUS_INTERNAL_ERROR] == 0;
    }
    if (!seccomp) std::printf("system calls were not watched: no seccomp here\n");
    return clean ? 0 : 1;
}
