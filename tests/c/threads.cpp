// Threads share a grasp, each with a distributor of its own; two in one distributor get right answers or "busy".

#include "random_grasps.hpp"

#include <atomic>
#include <thread>

namespace {

const std::size_t turns = 20000;

std::vector<double> wrench_at(std::size_t step) {
    std::vector<double> wrench(6);
    for (std::size_t k = 0; k < 6; ++k) wrench[k] = std::sin(1e-2 * static_cast<double>(step) + 1.7 * static_cast<double>(k));
    return wrench;
}

} // namespace

int main() {
    const Kind &kind = kinds[0];
    const Arrays arrays(kind, 3);
    gf_grasp *grasp = grasp_of(kind, arrays);
    gf_distributor *alone = distributor_of(kind, arrays, grasp), *shared = distributor_of(kind, arrays, grasp);
    std::vector<std::vector<double>> right(turns, std::vector<double>(12));
    for (std::size_t step = 0; step < turns; ++step)
        if (gf_distributor_solve(alone, wrench_at(step).data(), 6, right[step].data(), 12, nullptr, nullptr, 0) != 0)
            fail("not solved");

    std::atomic<std::size_t> wrong(0), busy(0), solved(0);
    const auto work = [&](gf_distributor *distributor, std::size_t offset) {
        std::vector<double> forces(12);
        for (std::size_t turn = 0; turn < turns; ++turn) {
            const std::size_t step = (turn + offset) % turns;
            const gf_status status =
                gf_distributor_solve(distributor, wrench_at(step).data(), 6, forces.data(), 12, nullptr, nullptr, 0);
            if (status == GF_STATUS_BUSY) {
                ++busy;
                std::this_thread::yield();
                continue;
            }
            bool same = status == GF_STATUS_SOLVED;
            for (std::size_t i = 0; i < 12; ++i) same = same && std::abs(forces[i] - right[step][i]) < 1e-9;
            ++(same ? solved : wrong);
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < 4; ++i) threads.emplace_back(work, shared, i * 997);
    for (std::thread &thread : threads) thread.join();
    std::printf("one distributor, four threads: %zu solved, %zu busy, %zu wrong\n", solved.load(), busy.load(), wrong.load());
    if (wrong > 0 || solved == 0 || solved + busy != 4 * turns) return 1;

    threads.clear();
    busy = solved = 0;
    for (std::size_t i = 0; i < 4; ++i)
        threads.emplace_back([&, i] {
            gf_distributor *own = distributor_of(kind, arrays, grasp);
            work(own, i * 997);
            gf_distributor_destroy(own);
        });
    for (std::thread &thread : threads) thread.join();
    std::printf("four distributors of one grasp: %zu solved, %zu busy, %zu wrong\n", solved.load(), busy.load(), wrong.load());
    if (wrong > 0 || solved != 4 * turns) return 1;

    // A distributor may move from thread to thread, and outlives its grasp.
    gf_grasp_destroy(grasp);
    std::thread(work, shared, 0).join();
    std::thread([&] { gf_distributor_destroy(shared); }).join();
    gf_distributor_destroy(alone);
    return wrong > 0 ? 1 : 0;
}
