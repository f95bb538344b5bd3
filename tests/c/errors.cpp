// What is wrong is named, and nothing crashes: NULL, wrong lengths, NaN, no contacts, structs that were not initialised.

#include "random_grasps.hpp"

#include <cstring>
#include <limits>

namespace {

char message[256];
std::size_t checked = 0;

/// The status is the one expected, and the message names all the words.
void expect(gf_status found, gf_status expected, std::initializer_list<const char *> words) {
    ++checked;
    bool named = expected == GF_STATUS_SOLVED ? message[0] == 0 : message[0] != 0;
    for (const char *word : words) named = named && std::strstr(message, word);
    if (found != expected || !named)
        fail("check " + std::to_string(checked) + ": " + gf_status_name(found) + ": " + message);
    std::printf("%-14s %s\n", gf_status_name(found), message);
}

} // namespace

int main() {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
    const Kind &kind = kinds[0];
    gf_grasp *grasp = nullptr;
    const auto create = [&](const gf_contacts &contacts, const gf_grasp_options *options = nullptr) {
        const gf_status status = gf_grasp_create(&contacts, options, &grasp, message, sizeof message);
        if (status != GF_STATUS_SOLVED && grasp) fail("a grasp in spite of an error");
        gf_grasp_destroy(grasp);
        return status;
    };

    Arrays arrays(kind, 1);
    expect(create(arrays.contacts), GF_STATUS_SOLVED, {});
    expect(gf_grasp_create(nullptr, nullptr, &grasp, message, sizeof message), GF_STATUS_NULL_POINTER, {"contacts"});
    expect(gf_grasp_create(&arrays.contacts, nullptr, nullptr, message, sizeof message), GF_STATUS_NULL_POINTER, {"grasp"});
    gf_contacts contacts = arrays.contacts;
    contacts.count = 0;
    expect(create(contacts), GF_STATUS_INVALID, {"positions", "at least one contact"});
    contacts.count = std::numeric_limits<std::size_t>::max();
    expect(create(contacts), GF_STATUS_INVALID, {"count", "18446744073709551615"});
    contacts = arrays.contacts;
    contacts.dim = 4;
    expect(create(contacts), GF_STATUS_INVALID, {"dim", "4"});
    contacts = arrays.contacts;
    contacts.size = 0;
    expect(create(contacts), GF_STATUS_INVALID, {"contacts", "init"});
    contacts = arrays.contacts;
    contacts.positions = nullptr;
    expect(create(contacts), GF_STATUS_NULL_POINTER, {"positions"});
    contacts = arrays.contacts;
    contacts.normals = reinterpret_cast<const double *>(reinterpret_cast<const char *>(contacts.normals) + 1);
    expect(create(contacts), GF_STATUS_NULL_POINTER, {"normals", "aligned"});
    contacts = arrays.contacts;
    const std::uint32_t two[] = {2, 2, 2, 2}, one_each[] = {1, 1, 1, 1};
    contacts.edges = two;
    expect(create(contacts), GF_STATUS_INVALID, {"edges", "contact 0", "2"});
    contacts = arrays.contacts;
    contacts.num_extreme_forces = one_each;
    expect(create(contacts), GF_STATUS_NULL_POINTER, {"extreme_forces"});
    contacts = arrays.contacts;
    contacts.dim = 2;
    contacts.tangents = arrays.normals.data();
    expect(create(contacts), GF_STATUS_INVALID, {"tangents"});

    arrays.positions[7] = nan;
    expect(create(arrays.contacts), GF_STATUS_INVALID, {"positions", "contact 2", "NaN"});
    arrays.positions[7] = 0.0;
    arrays.limits[3] = -2.5;
    expect(create(arrays.contacts), GF_STATUS_INVALID, {"max_normal_force", "contact 3", "-2.5"});
    arrays.limits[3] = 1.0;
    arrays.friction[1] = infinite;
    expect(create(arrays.contacts), GF_STATUS_INVALID, {"friction", "contact 1", "inf"});
    arrays.friction[1] = 0.5;
    gf_grasp_options grasp_options;
    gf_grasp_options_init(&grasp_options, sizeof grasp_options);
    grasp_options.length_scale = 0.0;
    expect(create(arrays.contacts, &grasp_options), GF_STATUS_INVALID, {"length_scale", "0"});

    grasp = grasp_of(kind, arrays);
    double matrix[72];
    expect(gf_grasp_matrix(grasp, matrix, 71, message, sizeof message), GF_STATUS_WRONG_LENGTH, {"matrix", "71", "72"});
    expect(gf_grasp_frames(nullptr, matrix, 36, message, sizeof message), GF_STATUS_NULL_POINTER, {"grasp"});
    gf_quality quality;
    gf_quality_options asked;
    gf_quality_options_init(&asked, sizeof asked);
    std::memset(&quality, 0, sizeof quality);
    expect(gf_grasp_quality(grasp, &asked, &quality, message, sizeof message), GF_STATUS_INVALID, {"quality", "init"});
    gf_quality_init(&quality, sizeof quality);
    asked.criterion = 5;
    expect(gf_grasp_quality(grasp, &asked, &quality, message, sizeof message), GF_STATUS_INVALID, {"criterion", "5"});
    asked.criterion = GF_CRITERION_SUM;
    asked.rtol = -1.0;
    expect(gf_grasp_quality(grasp, &asked, &quality, message, sizeof message), GF_STATUS_INVALID, {"rtol", "-1"});
    asked.rtol = 0.0;
    expect(gf_grasp_quality(grasp, &asked, nullptr, message, sizeof message), GF_STATUS_NULL_POINTER, {"quality"});

    gf_distributor *distributor = nullptr;
    gf_distributor_options options;
    gf_distributor_options_init(&options, sizeof options);
    const auto distribute = [&]() { return gf_distributor_create(grasp, &options, &distributor, message, sizeof message); };
    expect(gf_distributor_create(nullptr, nullptr, &distributor, message, sizeof message), GF_STATUS_NULL_POINTER, {"grasp"});
    options.objective = 9;
    expect(distribute(), GF_STATUS_INVALID, {"objective", "9"});
    options.objective = GF_OBJECTIVE_MAX;
    options.weight = nan;
    expect(distribute(), GF_STATUS_INVALID, {"weight", "NaN"});
    options.weight = 0.0;
    const double negative[] = {0.0, 0.0, -0.1, 0.0};
    options.min_normal = negative;
    expect(distribute(), GF_STATUS_INVALID, {"min_normal", "2", "-0.1"});
    options.min_normal = nullptr;
    options.weights = arrays.limits.data();
    expect(distribute(), GF_STATUS_INVALID, {"weights", "SQUARES"});
    options.weights = nullptr;
    options.objective = GF_OBJECTIVE_SQUARES;
    double slack[36] = {0.0};
    options.slack = slack;
    expect(distribute(), GF_STATUS_INVALID, {"slack"});
    options.slack = nullptr;
    options.weights = negative;
    expect(distribute(), GF_STATUS_INVALID, {"weights", "contact 0", "0"});
    options.weights = nullptr;
    options.objective = GF_OBJECTIVE_MAX;
    options.nearest_metric = slack;
    expect(distribute(), GF_STATUS_INVALID, {"nearest_metric"});
    options.nearest_metric = nullptr;
    expect(distribute(), GF_STATUS_SOLVED, {});

    double wrench[] = {0, 0, -1, 0, 0, 0}, forces[12] = {7.0};
    const auto solve = [&](std::size_t dim, std::size_t length, double *target) {
        return gf_distributor_solve(distributor, wrench, dim, target, length, nullptr, message, sizeof message);
    };
    expect(solve(3, 12, forces), GF_STATUS_WRONG_LENGTH, {"external_wrench", "3", "6"});
    expect(solve(6, 9, forces), GF_STATUS_WRONG_LENGTH, {"forces", "9", "12"});
    expect(solve(6, 12, nullptr), GF_STATUS_NULL_POINTER, {"forces"});
    wrench[4] = nan;
    expect(solve(6, 12, forces), GF_STATUS_INVALID, {"external_wrench", "component 4", "NaN"});
    if (forces[0] != 7.0) fail("forces were written in spite of an error");
    wrench[4] = 0.0;
    const auto nearest = [&](double *target, double *distance) {
        return gf_distributor_nearest(distributor, wrench, 6, target, 12, distance, nullptr, message, sizeof message);
    };
    expect(nearest(nullptr, nullptr), GF_STATUS_NULL_POINTER, {"forces"});
    expect(nearest(forces, reinterpret_cast<double *>(reinterpret_cast<char *>(slack) + 1)), GF_STATUS_NULL_POINTER,
           {"distance", "aligned"});
    wrench[2] = -1e6;
    double distance = 0.0;
    expect(nearest(forces, &distance), GF_STATUS_SOLVED, {});
    if (!(distance > 0.9e6 && distance < 1e6)) fail("a wrench beyond all limits is near");
    wrench[2] = -1.0;
    gf_solution solution = gf_solution();
    expect(gf_distributor_solve(distributor, wrench, 6, forces, 12, &solution, message, sizeof message), GF_STATUS_INVALID,
           {"solution", "init"});
    expect(gf_distributor_solve(nullptr, wrench, 6, forces, 12, nullptr, message, sizeof message), GF_STATUS_NULL_POINTER,
           {"distributor"});
    expect(gf_distributor_update(distributor, nullptr, message, sizeof message), GF_STATUS_NULL_POINTER, {"grasp"});
    double limits[] = {1.0, 2.0, -3.5, 0.0};
    const auto set_limits = [&](const double *given, std::size_t count) {
        return gf_distributor_set_limits(distributor, given, count, message, sizeof message);
    };
    expect(set_limits(limits, 4), GF_STATUS_INVALID, {"max_normal_force", "contact 2", "-3.5"});
    expect(set_limits(limits, 3), GF_STATUS_WRONG_LENGTH, {"max_normal_force", "3", "4"});
    expect(set_limits(nullptr, 4), GF_STATUS_NULL_POINTER, {"max_normal_force"});
    limits[2] = 5.0;
    expect(set_limits(limits, 4), GF_STATUS_SOLVED, {});
    expect(nearest(forces, &distance), GF_STATUS_SOLVED, {});
    if (forces[9] != 0.0) fail("a contact that is off presses");
    limits[3] = 10.0;
    expect(set_limits(limits, 4), GF_STATUS_SOLVED, {});
    const Kind flat = {"planar", 2, 3, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false};
    const Arrays planar(flat, 1);
    expect(gf_distributor_update_contacts(distributor, &planar.contacts, nullptr, message, sizeof message),
           GF_STATUS_INVALID, {"grasp", "planar"});
    arrays.normals[0] = arrays.normals[1] = arrays.normals[2] = 0.0;
    expect(gf_distributor_update_contacts(distributor, &arrays.contacts, nullptr, message, sizeof message),
           GF_STATUS_INVALID, {"normals", "contact 0"});
    expect(solve(6, 12, forces), GF_STATUS_SOLVED, {});

    // An older header has shorter structs: what it does not know is not written, and has its default.
    gf_solution_init(&solution, sizeof solution);
    solution.size = offsetof(gf_solution, gap);
    solution.gap = 7.0;
    expect(gf_distributor_solve(distributor, wrench, 6, forces, 12, &solution, message, sizeof message), GF_STATUS_SOLVED, {});
    if (!(solution.sigma > 0.0) || solution.gap != 7.0) fail("a shorter struct was not respected");

    // Messages are cut off, and need not be asked for.
    char short_message[9] = "********";
    gf_grasp *none = nullptr;
    gf_grasp_create(nullptr, nullptr, &none, short_message, 5);
    if (std::strcmp(short_message, "cont") != 0 || short_message[5] != '*') fail("a message beyond its buffer");
    if (gf_grasp_create(nullptr, nullptr, &none, nullptr, 0) != GF_STATUS_NULL_POINTER) fail("no message, no status");
    gf_grasp_destroy(nullptr);
    gf_grasp_destroy(grasp);
    gf_distributor_destroy(nullptr);
    gf_distributor_destroy(distributor);
    if (std::strcmp(gf_status_name(99), "UNKNOWN") != 0) fail("a status that does not exist has a name");
    std::printf("%zu checks\n", checked);
}
