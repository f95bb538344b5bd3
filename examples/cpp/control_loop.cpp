// Four fingers move a cup of 0.5 kg at 1 kHz. Prints how long the ticks took; arguments: ticks, microseconds of each.
#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <graspforce.h>
#include <thread>
#include <vector>

using Clock = std::chrono::steady_clock;
using Rows = Eigen::Matrix<double, 4, 3, Eigen::RowMajor>;  // one row for each finger, as the library takes them

char message[256];

void check(gf_status status) {
    if (status == GF_STATUS_SOLVED) return;
    std::fprintf(stderr, "%s: %s\n", gf_status_name(status), message);
    std::exit(1);
}

int main(int count, char **arguments) {
    const std::size_t ticks = count > 1 ? std::strtoul(arguments[1], nullptr, 10) : 5000;
    const std::chrono::microseconds period(count > 2 ? std::atoi(arguments[2]) : 1000);
    const Rows positions = (Rows() << 0.04, 0, 0, 0, 0.04, 0.01, -0.04, 0, 0.02, 0, -0.04, -0.01).finished();
    const Rows normals = (Rows() << -1, 0, 0.1, 0, -1, 0, 1, 0, 0, 0, 1, 0.1).finished();  // into the cup
    const Eigen::Vector4d friction = Eigen::Vector4d::Constant(0.6), limits = Eigen::Vector4d::Constant(20);  // N
    gf_contacts contacts;
    gf_contacts_init(&contacts, sizeof contacts);
    contacts.count = 4;
    contacts.positions = positions.data();
    contacts.normals = normals.data();
    contacts.friction = friction.data();
    contacts.max_normal_force = limits.data();
    gf_grasp *grasp;
    check(gf_grasp_create(&contacts, nullptr, &grasp, message, sizeof message));
    gf_distributor *fingers;
    check(gf_distributor_create(grasp, nullptr, &fingers, message, sizeof message));

    Rows forces;  // contact frames: normal force and two components of friction, in N
    std::vector<double> latency(ticks);
    Clock::time_point tick = Clock::now();
    for (std::size_t k = 0; k < ticks; ++k) {
        std::this_thread::sleep_until(tick += period);
        const Clock::time_point start = Clock::now();
        const double t = 1e-3 * static_cast<double>(k);
        const Eigen::Vector3d acceleration(2 * std::sin(3 * t), 2 * std::sin(5 * t), std::cos(2 * t));
        const Eigen::Vector3d torque(0.02 * std::cos(3 * t), 0.02 * std::sin(2 * t), 0.03 * std::sin(4 * t));
        Eigen::Matrix<double, 6, 1> external;
        external << 0.5 * (Eigen::Vector3d(0, 0, -9.81) - acceleration), torque;
        check(gf_distributor_solve(fingers, external.data(), 6, forces.data(), 12, nullptr, message, sizeof message));
        latency[k] = std::chrono::duration<double, std::micro>(Clock::now() - start).count();
    }
    std::sort(latency.begin(), latency.end());
    std::printf("%-6s %7zu", "C++", ticks);
    for (double share : {0.5, 0.99, 0.999, 1.0}) std::printf(" %9.3f", latency[static_cast<std::size_t>((ticks - 1) * share)]);
    std::puts("");
    gf_distributor_destroy(fingers);
    gf_grasp_destroy(grasp);
}
